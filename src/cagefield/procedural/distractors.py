"""Distractors, which move while a capture is taken: a person, and a sheet held behind the object.

Lengths in the rooms' units of some 25 cm; a distractor is lit like the room, casts no shadow, and is not
reflected.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter

from cagefield.cameras.camera import Camera
from cagefield.errors import SceneError
from cagefield.procedural.building import MATTE, SATIN, build_part, place_shape, tube
from cagefield.procedural.hand_held import (
    MIN_EDGE_CONTRAST,
    fine_directions,
    local_contrast,
    pixel_directions,
)
from cagefield.procedural.parts import Part, pose_matrix
from cagefield.procedural.room_light import Room
from cagefield.procedural.scene import ProceduralScene
from cagefield.procedural.shapes import Box, Sphere
from cagefield.procedural.textures import Checker, Mottled, Plain, Stripes, rgb_from_hex
from cagefield.typing import Array, Float32, Mask

PERSON_HEIGHT = 6.8
"""Height of a person, room units: 1.7 m."""

PERSON_RADIUS = 0.8
"""Minimum level distance of a person's center from walls and furniture, room units."""

PERSON_CLEARANCE = 2.0
"""Minimum level distance of a person from the camera, room units."""

SHEET_HALF_SIZE = (1.5, 1.1)
"""Half width and half height of the sheet, room units: 75 x 55 cm."""

SHEET_DISTANCE_RANGE = (1.3, 2.0)
"""Least and largest distance of the sheet behind the photographed point, room units."""

_MAX_PERSON_PLACES = 400
"""Number of random positions of a person that are tried for each photo."""

_SKIN, _HAIR = (
    Plain(rgb_from_hex("#c9987a"), 0.02),
    Mottled(rgb_from_hex("#3a2a20"), rgb_from_hex("#57402e"), 0.08),
)
_TROUSERS = Mottled(rgb_from_hex("#2b3a58"), rgb_from_hex("#3d5077"), 0.15, 0.6)
_SWEATER = Stripes(rgb_from_hex("#b4432f"), rgb_from_hex("#e4d3a8"), (0, 0, 1), 0.3, 0.4)
_SHOES = Plain(rgb_from_hex("#3b3531"), 0.02)


def build_person(position: Array, heading_deg: float, stride: float = 0.0) -> Part:
    """Person whose feet are at `position` [3], looking along +y rotated by `heading_deg` about z.

    stride: from -1 to 1, how far the left foot is ahead of the right one.
    """
    step = 0.75 * stride
    limbs = []
    for side in (-1.0, 1.0):
        ahead = -side * step
        knee, foot = (0.4 * side, 0.6 * ahead + 0.12, 1.85), (0.4 * side, ahead, 0.3)
        limbs.append(tube([(0.36 * side, 0.0, 3.3), knee, foot], (0.46, 0.36, 0.26), _TROUSERS, gloss=MATTE))
        shoe = (0.4 * side, ahead + 0.16, 0.14)
        limbs.append(place_shape(Sphere(1.0), _SHOES, shoe, scale=(0.2, 0.48, 0.16), gloss=SATIN))
        elbow, hand = (1.0 * side, -0.5 * ahead - 0.1, 4.3), (0.92 * side, -0.9 * ahead + 0.25, 3.3)
        limbs.append(tube([(0.78 * side, 0.0, 5.35), elbow, hand], (0.27, 0.22, 0.17), _SWEATER, gloss=MATTE))
        limbs.append(place_shape(Sphere(0.2), _SKIN, hand, gloss=MATTE))
    body = (
        tube([(0, 0, 3.45), (0, 0, 4.4), (0, 0, 5.2)], (0.62, 0.6, 0.66), _SWEATER, gloss=MATTE),
        tube([(0, 0, 5.4), (0, 0.02, 5.95)], (0.3, 0.24), _SKIN, gloss=MATTE),
        place_shape(Sphere(1.0), _SKIN, (0, 0.06, 6.25), scale=(0.36, 0.42, 0.48), gloss=SATIN),
        place_shape(Sphere(1.0), _HAIR, (0, -0.04, 6.36), scale=(0.4, 0.44, 0.44), gloss=SATIN),
    )
    revolve = pose_matrix(position, (0, 0, heading_deg))
    return replace(build_part("person", *body, *limbs), motion=revolve).with_baked_motion()


def build_sheet(center: Array, normal: Array, roll_deg: float) -> Part:
    """Sheet of checkered board about `center` [3], facing along `normal` [3], rotated about it by
    `roll_deg`.
    """
    forward = normal / np.linalg.norm(normal)
    right = np.cross((0.0, 0.0, 1.0), forward)
    right = right / np.linalg.norm(right) if np.linalg.norm(right) > 1e-6 else np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(forward, right), forward, center], 1)
    pattern = Checker(rgb_from_hex("#e9c83f"), rgb_from_hex("#27585f"), 0.24)
    board = place_shape(Box((*SHEET_HALF_SIZE, 0.02)), pattern, gloss=MATTE)
    return replace(
        build_part("backdrop", board), motion=pose @ pose_matrix(rotate_deg=(0, 0, roll_deg))
    ).with_baked_motion()


def place_person_in_view(scene: ProceduralScene, camera: Camera, rng: np.random.RandomState) -> Part | None:
    """Person on the room's floor whose center is in the image; None where there is no free position."""
    room = _room(scene)
    low, high = np.array(room.low) + PERSON_RADIUS, np.array(room.high) - PERSON_RADIUS
    places = np.column_stack(
        [rng.uniform(low[:2], high[:2], (_MAX_PERSON_PLACES, 2)), np.full(_MAX_PERSON_PLACES, room.low[2])]
    )
    heading, stride = rng.uniform(0, 360), rng.uniform(-1, 1)
    free = np.linalg.norm(places[:, :2] - camera.origin[:2], axis=1) > PERSON_CLEARANCE
    for thing in room.furniture(scene.parts):
        box = thing.bounds
        gap = np.maximum(np.maximum(box[0, :2] - places[:, :2], places[:, :2] - box[1, :2]), 0)
        free &= (np.linalg.norm(gap, axis=1) > PERSON_RADIUS) | (box[0, 2] > room.low[2] + PERSON_HEIGHT)
    for height in (0.5, 0.65, 0.8, 0.35):
        pixel, ahead = camera.project(places + np.array([0, 0, height * PERSON_HEIGHT]))
        with np.errstate(invalid="ignore"):
            inside = (pixel >= 0).all(axis=1) & (pixel < (camera.width, camera.height)).all(axis=1)
        visible = np.flatnonzero(free & inside & (ahead > 0))
        if len(visible):
            return build_person(places[visible[0]], heading, stride)
    return None


def place_sheet_behind(
    scene: ProceduralScene,
    camera: Camera,
    target: tuple[float, float, float] | None,
    rng: np.random.RandomState,
) -> Part:
    """Sheet behind a point, as seen from the camera; without a point, halfway to the wall in the line of
    sight.
    """
    room = _room(scene)
    aim = camera.forward if target is None else (target - camera.origin)
    distance = float(np.linalg.norm(aim))
    ray = aim / distance
    with np.errstate(divide="ignore"):
        walls = (
            np.where(ray > 0, np.array(room.high) - camera.origin, np.array(room.low) - camera.origin) / ray
        )
    to_wall = float(np.min(walls[np.isfinite(walls)]))
    share = rng.uniform()
    sheet_distance = (
        distance + SHEET_DISTANCE_RANGE[0] + (SHEET_DISTANCE_RANGE[1] - SHEET_DISTANCE_RANGE[0]) * share
    )
    if target is None:
        sheet_distance = (0.45 + 0.3 * share) * to_wall
    center = camera.origin + min(sheet_distance, 0.95 * to_wall) * ray + rng.uniform(-0.35, 0.35, 3)
    return build_sheet(center, -ray + rng.uniform(-0.25, 0.25, 3), rng.normal(0, 8.0))


def add_distractors(
    scene: ProceduralScene, parts: tuple[Part, ...], camera: Camera, rgb: Float32, distance: Float32
) -> tuple[Float32, Float32, Mask]:
    """(rgb [H,W,3], distance [H,W], distractor pixels [H,W]) of an image with parts added to its scene.

    Pixels at edges are the mean of four rays, as in `hand_held.render_image`; a pixel shows a distractor
    where one of its rays meets it first.
    """
    alone = scene.with_parts(parts)
    shape = (camera.height, camera.width)
    added, _, hits = alone.shoot(camera.origin, pixel_directions(camera))
    nearer = np.asarray(hits.t.reshape(shape) < distance)
    image = np.where(nearer[..., None], added.reshape(*shape, 3), rgb)
    edges = maximum_filter(nearer, 3) & (local_contrast(image) > MIN_EDGE_CONTRAST)
    is_distractor: Mask = np.logical_and(nearer, ~edges)
    rows, columns = np.nonzero(edges)
    if len(rows):
        directions = fine_directions(camera, rows, columns)
        sharp, _, behind = scene.shoot(camera.origin, directions)
        front, _, ahead = alone.shoot(camera.origin, directions)
        first = np.asarray(ahead.t < behind.t)
        mixed = np.where(first[:, None], front, sharp).reshape(len(rows), 4, 3).mean(axis=1)
        has_distractor = np.asarray(first.reshape(-1, 4).any(axis=1)) | nearer[rows, columns]
        is_distractor[rows, columns] = has_distractor
        # without a ray that meets it, a pixel is as it was
        image[rows, columns] = np.where(has_distractor[:, None], mixed, rgb[rows, columns])
    return image.astype(np.float32), np.where(nearer, hits.t.reshape(shape), distance), is_distractor


def _room(scene: ProceduralScene) -> Room:
    if scene.room is None:
        raise SceneError(f"scene {scene.name} has no room for persons and sheets; take a built-in room")
    return scene.room
