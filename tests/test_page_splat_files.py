"""Splats and their edits as files for pages: what comes back of them, and what broken ones say."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cagefield.edits import Edit, EditStack
from cagefield.errors import FieldError
from cagefield.fields.splat_field import SplatField
from cagefield.geometry.cage import Cage
from cagefield.geometry.quaternions import rotation_matrices
from cagefield.pages.page_splat_edits import decode_page_splat_edits, encode_page_splat_edits
from cagefield.pages.page_splats import (
    CHUNK,
    COLOR_STEP,
    OFF,
    SH_STEP,
    decode_page_splats,
    encode_page_splats,
    page_order,
)
from cagefield.rendering.splats.raster_splats import changed_splats, deformed_splats
from cagefield.rendering.splats.splitting import split_of
from splat_scenes import random_splats


@pytest.mark.parametrize("degree", [0, 2, 4])
@pytest.mark.parametrize("antialiased", [False, True])
def test_numbers_come_back_to_half_a_step(degree: int, antialiased: bool) -> None:
    field = dataclasses.replace(random_splats(3 * CHUNK + 7, degree), antialiased=antialiased)
    found = decode_page_splats(encode_page_splats(field, background=(0.2, 0.4, 0.6)))
    assert found.background == (0.2, 0.4, 0.6) and found.ends == (len(field),)
    back, order = found.field, page_order(field)
    assert back.antialiased == antialiased
    np.testing.assert_array_equal(back.bounds, field.bounds)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(field)))
    assert np.abs(back.means - field.means[order]).max() <= OFF * np.linalg.norm(field.half_size)
    np.testing.assert_allclose(
        back.log_scales, field.log_scales[order], atol=0.5001 * 32.0 * (1 / 4095 + 1 / 65535)
    )
    np.testing.assert_allclose(back.opacities, field.opacities[order], atol=0.5001 * (1 / 1023 + 1 / 65535))
    turned = rotation_matrices(back.quaternions) - rotation_matrices(field.quaternions[order])
    # Three numbers of 12 bits over [-0.71, 0.71].
    assert np.abs(turned).max() <= 4.0 * 0.5 * np.sqrt(2.0) / 4095 * np.sqrt(3.0)
    steps = np.maximum(np.abs(field.sh[:, 1:]).max(axis=(0, 2), initial=0.0) / 127.0, SH_STEP)
    off = np.abs(back.sh - field.sh[order]).max(axis=(0, 2))
    assert off[0] <= 0.5001 * COLOR_STEP and (off[1:] <= 0.5001 * steps).all()


def test_splats_far_away_cost_a_byte_and_not_their_place() -> None:
    field = random_splats(2 * CHUNK, 0)
    means = field.means.copy()
    means[::3] *= 3000.0
    far = SplatField(
        means, field.log_scales, field.quaternions, field.opacities, field.sh, bounds=[[-1.0] * 3, [1.0] * 3]
    )
    back = decode_page_splats(encode_page_splats(far)).field
    off = np.linalg.norm(back.means - means[page_order(far)], axis=1)
    away = np.maximum(np.linalg.norm(means[page_order(far)], axis=1), np.sqrt(3.0))
    assert (off <= 2.0 * OFF * away).all()


def test_what_covers_most_comes_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cagefield.pages.page_splats.FIRST", 100)
    field = random_splats(500, 0)
    found = decode_page_splats(encode_page_splats(field))
    assert found.ends == (100, 500)
    covers = found.field.opacities * np.exp(np.sort(found.field.log_scales, axis=1)[:, 1:].sum(axis=1))
    assert covers[:100].min() > 0.98 * covers[100:].max()


CAGE = Cage.box((0.0, 0.0, 0.0), 1.0)


@pytest.mark.parametrize(("preserve_opacity", "packed"), [(True, False), (False, False), (True, True)])
def test_splats_less_what_goes_and_what_comes_are_the_edited_ones(
    preserve_opacity: bool, packed: bool
) -> None:
    field = random_splats(300, 1)
    field = dataclasses.replace(field, log_scales=field.log_scales - 1.5)
    twisted = Edit.continuous(CAGE, CAGE.grown(0.4)).rotate((0.3, 0.0, 0.9)).scale(0.9)
    copied = Edit.copy(Cage.box((0.5, 0.5, 0.0), 0.5))
    edits = EditStack([twisted, copied.translate((0.6, 0.0, 0.3)), Edit.delete(Cage.box((-0.8,) * 3, 0.3))])
    split = split_of(field, edits)
    assert split is not None
    np.testing.assert_array_equal(split.children.field.sh, field.sh[split.sources])
    wanted = deformed_splats(field, edits, preserve_opacity=preserve_opacity, split=split)
    changed = changed_splats(field, edits, preserve_opacity=preserve_opacity, split=split)
    found = decode_page_splat_edits(encode_page_splat_edits(field, changed, packed=packed))
    base, order = deformed_splats(field, EditStack()), page_order(field)
    kept = order[~found.hidden]
    assert 0 < len(kept) < len(field) and len(kept) + len(found.means) == len(wanted)
    got = {
        "means": np.concatenate([base.means[kept], found.means + field.center]),
        "covariances": np.concatenate([base.covariances[kept], found.covariances]),
        "opacities": np.concatenate([base.opacities[kept], found.opacities])[:, None],
        "sh": np.concatenate([base.sh[kept], base.sh[order[found.sources]]]).reshape(len(wanted), -1),
        "rotations": np.concatenate(
            [np.broadcast_to(np.eye(3), (len(kept), 3, 3)), rotation_matrices(found.turns)]
        ).reshape(-1, 9),
    }
    assert wanted.rotations is not None
    all_wanted = np.concatenate(
        [
            wanted.means, wanted.covariances, wanted.opacities[:, None], wanted.sh.reshape(len(wanted), -1),
            wanted.rotations.reshape(-1, 9),
        ],
        axis=1,
    )  # fmt: skip
    all_got = np.concatenate(list(got.values()), axis=1)
    distance, rows = cKDTree(all_got).query(all_wanted)
    # Scales of 12 bits are off by half a percent, of sizes up to about .2.
    assert len(np.unique(rows)) == len(rows) and distance.max() < (3e-3 if packed else 1e-3)


def test_no_edits_change_nothing() -> None:
    field = random_splats(20, 0)
    found = decode_page_splat_edits(encode_page_splat_edits(field, changed_splats(field, EditStack())))
    assert not found.hidden.any() and found.means.shape == (0, 3)


def test_discs_and_empty_fields_are_refused() -> None:
    field = random_splats(5, 0)
    with pytest.raises(FieldError, match="the server draws this scene: its splats are discs"):
        encode_page_splats(dataclasses.replace(field, discs=True))
    with pytest.raises(FieldError, match="no splats to show"):
        encode_page_splats(field.take(np.zeros(5, bool)))


@pytest.mark.parametrize(("edits", "packed"), [(False, False), (True, False), (True, True)])
def test_cut_and_garbled_files_are_refused_in_a_line(edits: bool, packed: bool) -> None:
    field = random_splats(30, 1)
    edit = Edit.move(CAGE).translate((1.0, 0.0, 0.0)) if packed else Edit.delete(CAGE)
    changed = changed_splats(field, EditStack([edit]))
    whole = encode_page_splat_edits(field, changed, packed=packed) if edits else encode_page_splats(field)
    decode = decode_page_splat_edits if edits else decode_page_splats
    for cut in range(0, len(whole), 11):
        with pytest.raises(FieldError) as caught:
            decode(whole[:cut])
        assert "\n" not in str(caught.value)
    rng, refused = np.random.default_rng(0), 0
    for _ in range(200):
        bad = bytearray(whole)
        bad[int(rng.integers(len(bad)))] ^= 1 << int(rng.integers(8))
        try:
            decode(bytes(bad))
        except FieldError as error:
            refused += 1
            assert "\n" not in str(error)
    assert refused > 80
