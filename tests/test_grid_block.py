"""Grid blocks: properties of the density outlive changes of color."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from cagefield.completion.surfaces.block_extraction import extract_block
from cagefield.completion.surfaces.grid_block import GridBlock
from cagefield.edits import EditStack
from scenes import ball_field


def cached_names() -> list[str]:
    return [name for name, value in vars(GridBlock).items() if isinstance(value, cached_property)]


def test_properties_of_the_density_are_not_computed_again_for_other_colors() -> None:
    field = ball_field(radius=0.5)
    block = extract_block(field, EditStack(), field.bounds)
    assert {"_smooth_opacity", "surface", "depth"} <= set(cached_names())
    values = {name: getattr(block, name) for name in cached_names()}
    mask = block.slot >= 0
    darker = block.scale_colors(mask, np.full(int(mask.sum()), 0.5))
    again = replace(darker)
    assert not set(values) & set(again.__dict__)
    for name, value in values.items():
        assert darker.__dict__[name] is value
        np.testing.assert_array_equal(getattr(again, name), value)
    np.testing.assert_allclose(darker.mean_colors(mask), 0.5 * block.mean_colors(mask), atol=1e-6)


def test_another_density_has_properties_of_its_own() -> None:
    field = ball_field(radius=0.5)
    block = extract_block(field, EditStack(), field.bounds)
    assert block.surface.any()
    emptied = block.with_density(block.solid, np.zeros(int(block.solid.sum()), np.float32))
    assert not emptied.surface.any() and not emptied.solid.any()


def test_a_compact_block_has_the_coefficients_of_its_own_vertices() -> None:
    field = ball_field(resolution=33)
    part = extract_block(field, EditStack(), field.bounds).crop(
        np.array([10, 10, 10]), np.array([18, 20, 22])
    )
    compact = part.compact()
    stored = part.slot >= 0
    assert len(compact.sh) == np.count_nonzero(stored) < len(part.sh)
    np.testing.assert_array_equal(compact.slot >= 0, stored)
    np.testing.assert_array_equal(compact.sh[compact.slot[stored]], part.sh[part.slot[stored]])
    layers = part.to_layer(), compact.to_layer()
    np.testing.assert_array_equal(layers[0].sh, layers[1].sh)
