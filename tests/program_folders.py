"""Folders as capture programs write them, of cameras that are known; written from the formats' descriptions.

All take `Shot`s: a name, an OpenGL camera-to-world matrix [4,4] in a world with z up, and the intrinsics of
OpenCV's model. Photos are small, of one color each.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from posed_photos import ring

WIDTH, HEIGHT = 48, 32


@dataclass(frozen=True)
class Shot:
    name: str
    pose: np.ndarray
    focal: tuple[float, float] = (40.0, 40.0)
    center: tuple[float, float] = (25.0, 15.5)
    radial: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    tangential: tuple[float, float] = (0.0, 0.0)
    size: tuple[int, int] = (WIDTH, HEIGHT)


def shots(count: int = 6, distorted: bool = True, **changes) -> list[Shot]:
    """Cameras on a ring, each rolled and moved a little on its own."""
    chance = np.random.default_rng(4)
    found = []
    for n, pose in enumerate(ring(count)):
        roll, pitch = chance.uniform(-0.2, 0.2, 2)
        turn = np.eye(4)
        turn[:3, :3] = rotation_z(roll) @ rotation_x(pitch)
        pose = pose @ turn
        pose[:3, 3] += chance.uniform(-0.3, 0.3, 3)
        found.append(Shot(f"IMG_{n:04}.png", pose))
    if distorted:
        lens = {"radial": (0.05, -0.02, 0.004, 0.001), "tangential": (0.002, -0.003)}
        found = [replace(shot, **lens) for shot in found]
    return [replace(shot, **changes) for shot in found]


def rotation_x(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def rotation_y(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def rotation_z(angle: float) -> np.ndarray:
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


Y_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
"""From a world with z up to one with y up."""


def in_opencv_axes(pose: np.ndarray) -> np.ndarray:
    """Camera to world [4,4] from axes x right, y down, z forward."""
    return pose @ np.diag([1.0, -1.0, -1.0, 1.0])


def world_to_camera(pose: np.ndarray) -> np.ndarray:
    """In OpenCV axes [4,4]."""
    return np.linalg.inv(in_opencv_axes(pose))


def save_photo(path: Path, number: int, size: tuple[int, int] = (WIDTH, HEIGHT)) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.new("RGB", size, (10 + number, 200 - number, 90)).save(path)


def save_photos(folder: Path, found: Sequence[Shot]) -> None:
    for number, shot in enumerate(found):
        save_photo(folder / shot.name, number, shot.size)


def polycam(folder: Path, found: Sequence[Shot], corrected: bool = True) -> None:
    prefix = "corrected_" if corrected else ""
    for number, shot in enumerate(found):
        name = f"{10000 + 37 * number}"
        save_photo(folder / "keyframes" / f"{prefix}images" / f"{name}.jpg", number, shot.size)
        pose = Y_UP @ shot.pose
        values = {f"t_{row}{column}": float(pose[row, column]) for row in range(3) for column in range(4)}
        values |= {"fx": shot.focal[0], "fy": shot.focal[1], "cx": shot.center[0], "cy": shot.center[1]}
        values |= {"width": shot.size[0], "height": shot.size[1], "blur_score": 120.5}
        file = folder / "keyframes" / f"{prefix}cameras" / f"{name}.json"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(values))


def quaternion_of(rotation: np.ndarray) -> list[float]:
    """(x, y, z, w), by the axis and the angle."""
    values, vectors = np.linalg.eig(rotation)
    axis = np.real(vectors[:, np.argmin(np.abs(values - 1))])
    cosine = 0.5 * (np.trace(rotation) - 1)
    skew = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    angle = math.atan2(float(skew @ axis), float(cosine))
    return [*(math.sin(angle / 2) * axis).tolist(), math.cos(angle / 2)]


def record3d(folder: Path, found: Sequence[Shot], each: bool = False) -> None:
    shot = found[0]
    poses = []
    for number, one in enumerate(found):
        save_photo(folder / "rgb" / f"{number}.jpg", number, one.size)
        pose = Y_UP @ one.pose
        poses.append([*quaternion_of(pose[:3, :3]), *pose[:3, 3].tolist()])
    values = {"w": shot.size[0], "h": shot.size[1], "fps": 60, "poses": poses}
    values["K"] = [shot.focal[0], 0, 0, 0, shot.focal[1], 0, shot.center[0], shot.center[1], 1]
    if each:
        values["perFrameIntrinsicCoeffs"] = [[*one.focal, *one.center] for one in found]
        values["K"] = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    folder.joinpath("metadata.json").write_text(json.dumps(values))


def similarity(scale: float = 2.5) -> tuple[float, np.ndarray, np.ndarray]:
    """A scale, a rotation [3,3] and a translation [3]."""
    return scale, rotation_z(0.4) @ rotation_x(-1.1), np.array([3.0, -2.0, 5.0])


def _row(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


def metashape(
    folder: Path,
    found: Sequence[Shot],
    kind: str = "frame",
    component: tuple[float, np.ndarray, np.ndarray] | None = None,
    chunk: tuple[float, np.ndarray, np.ndarray] | None = None,
    extra: str = "",
    b2: float = 0.0,
) -> None:
    """World = chunk(component(local)); each of the similarities (scale, rotation, translation)."""
    save_photos(folder / "images", found)
    shot = found[0]
    width, height = shot.size
    (k1, k2, k3, k4), (p1, p2) = shot.radial, shot.tangential
    lens = {
        "f": shot.focal[1], "cx": shot.center[0] - width / 2, "cy": shot.center[1] - height / 2,
        "b1": shot.focal[0] - shot.focal[1], "b2": b2,
        "k1": k1, "k2": k2, "k3": k3, "k4": k4, "p1": p2, "p2": p1,
    }  # fmt: skip

    def transform(one: tuple[float, np.ndarray, np.ndarray] | None) -> str:
        if one is None:
            return ""
        scale, rotation, translation = one
        return (
            f"<transform><rotation>{_row(rotation)}</rotation><translation>{_row(translation)}</translation>"
            f"<scale>{scale!r}</scale></transform>"
        )

    cameras = ""
    for number, one in enumerate(found):
        local = in_opencv_axes(one.pose)
        for outer in (chunk, component):
            if outer is not None:
                scale, rotation, translation = outer
                local[:3, 3] = rotation.T @ (local[:3, 3] - translation) / scale
                local[:3, :3] = rotation.T @ local[:3, :3]
        cameras += (
            f'<camera id="{number}" sensor_id="0" component_id="0" label="{one.name.removesuffix(".png")}">'
            f"<transform>{_row(local)}</transform><orientation>1</orientation></camera>\n"
        )
    calibration = "".join(f"<{key}>{value!r}</{key}>" for key, value in lens.items())
    size = f'<resolution width="{width}" height="{height}"/>'
    folder.joinpath("cameras.xml").write_text(
        f"""<?xml version="1.0" encoding="UTF-8"?>
<document version="2.0.0"><chunk label="Chunk 1" enabled="true">
<sensors next_id="1"><sensor id="0" label="unknown" type="{kind}">{size}
<property name="pixel_width" value="0.01"/>
<calibration type="{kind}" class="initial">{size}<f>1</f></calibration>
<calibration type="{kind}" class="adjusted">{size}{calibration}</calibration></sensor></sensors>
<components next_id="1" active_id="0"><component id="0" label="Component 1">{transform(component)}</component>
</components>
<cameras next_id="9">{cameras}{extra}</cameras>{transform(chunk)}
</chunk></document>
"""
    )


def heading_pitch_roll(rotation: np.ndarray) -> tuple[float, float, float]:
    """Degrees of OpenGL camera to world = Rz(-heading) Rx(pitch) Ry(roll), solved entry by entry."""
    pitch = math.asin(rotation[2, 1])
    heading = -math.atan2(-rotation[0, 1], rotation[1, 1])
    roll = math.atan2(-rotation[2, 0], rotation[2, 2])
    return math.degrees(heading), math.degrees(pitch), math.degrees(roll)


def reality_capture(folder: Path, found: Sequence[Shot], header: str = "", comment: bool = False) -> None:
    save_photos(folder / "images", found)
    names = header or "#name,x,y,alt,heading,pitch,roll,f,px,py,k1,k2,k3,k4,t1,t2"
    lines = [f"#cameras {len(found)}"] * comment + [names]
    for shot in found:
        longer = max(shot.size)
        px, py = ((c - side / 2) / longer for c, side in zip(shot.center, shot.size, strict=True))
        values = [
            *shot.pose[:3, 3],
            *heading_pitch_roll(shot.pose[:3, :3]),
            36 * shot.focal[0] / longer,
            px,
            py,
        ]
        values += [*shot.radial, shot.tangential[1], shot.tangential[0]]
        lines.append(",".join([shot.name, *(repr(float(value)) for value in values)]))
    folder.joinpath("cameras.csv").write_text("\n".join(lines) + "\n")


def opencv_csv(folder: Path, found: Sequence[Shot]) -> None:
    save_photos(folder / "images", found)
    names = [f"R{i}{j}" for i in range(3) for j in range(3)]
    lines = [f"#name,tx,ty,tz,{','.join(names)},f_pix,px_pix,py_pix,k1,k2,t2,t1,k3,k4"]
    for shot in found:
        w2c = world_to_camera(shot.pose)
        (k1, k2, k3, k4), (p1, p2) = shot.radial, shot.tangential
        values = [*w2c[:3, 3], *w2c[:3, :3].ravel(), shot.focal[0], *shot.center, k1, k2, p1, p2, k3, k4]
        lines.append(",".join([shot.name, *(repr(float(value)) for value in values)]))
    folder.joinpath("cameras.csv").write_text("\n".join(lines) + "\n")


def xmp(folder: Path, found: Sequence[Shot], model: str = "brown4t2", coefficients: str = "") -> None:
    save_photos(folder, found)
    for shot in found:
        longer = max(shot.size)
        u, v = ((c - side / 2) / longer for c, side in zip(shot.center, shot.size, strict=True))
        lens = coefficients or _row(np.array([*shot.radial, shot.tangential[1], shot.tangential[0]]))
        folder.joinpath(shot.name).with_suffix(".xmp").write_text(
            f"""<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description xcr:Version="3" xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#"
 xcr:DistortionModel="{model}" xcr:FocalLength35mm="{36 * shot.focal[0] / longer!r}" xcr:Skew="0"
 xcr:AspectRatio="1" xcr:PrincipalPointU="{u!r}" xcr:PrincipalPointV="{v!r}" xcr:PosePrior="exact">
<xcr:Rotation>{_row(world_to_camera(shot.pose)[:3, :3])}</xcr:Rotation>
<xcr:Position>{_row(shot.pose[:3, 3])}</xcr:Position>
<xcr:DistortionCoeficients>{lens}</xcr:DistortionCoeficients>
</rdf:Description></rdf:RDF></x:xmpmeta>
"""
        )


def meshroom(
    folder: Path,
    found: Sequence[Shot],
    version: tuple[int, int, int] = (1, 2, 8),
    kind: str = "brown",
    params: Sequence[float] | None = None,
    points: Sequence[tuple[np.ndarray, Sequence[int]]] = (),
    name: str = "cameras.sfm",
) -> None:
    """All numbers as text; `points` are positions and the numbers of the shots that see them."""
    save_photos(folder / "images", found)
    shot = found[0]
    width, height = shot.size
    intrinsic: dict[str, object] = {"intrinsicId": "77", "width": str(width), "height": str(height)}
    intrinsic |= {"serialNumber": "", "locked": "1", "type": kind}
    fx, fy = shot.focal
    if version < (1, 2, 0):
        intrinsic["pxFocalLength"] = repr(fx)
    elif version < (1, 2, 2):
        intrinsic["pxFocalLength"] = [repr(fx), repr(fy)]
    else:
        intrinsic |= {"sensorWidth": "36", "sensorHeight": "24", "focalLength": repr(fx * 36 / width)}
        intrinsic["pixelRatio"] = repr(fx / fy if version < (1, 2, 5) else fy / fx)
    if version >= (1, 2, 8) and not kind.startswith("fisheye"):
        intrinsic |= {"type": "pinhole", "distortionType": kind, "undistortionType": "none"}
        intrinsic["undistortionParams"] = ""
    offset = (0.0, 0.0) if version < (1, 2, 1) else (width / 2, height / 2)
    intrinsic["principalPoint"] = [repr(c - o) for c, o in zip(shot.center, offset, strict=True)]
    lens = (*shot.radial[:3], *shot.tangential) if params is None else params
    intrinsic["distortionParams"] = [repr(float(value)) for value in lens] if len(lens) else ""
    views, poses = [], []
    for number, one in enumerate(found):
        views.append({
            "viewId": str(500 + number), "poseId": str(900 + number), "intrinsicId": "77",
            "path": f"/home/someone/project/images/{one.name}", "width": str(width), "height": str(height),
            "metadata": {"Make": "none"},
        })  # fmt: skip
        columns = world_to_camera(one.pose)[:3, :3].T.ravel()  # Eigen's matrices are column-major
        transform = {"rotation": _row(columns).split(), "center": _row(one.pose[:3, 3]).split()}
        poses.append({"poseId": str(900 + number), "pose": {"transform": transform, "locked": "0"}})
    values: dict[str, object] = {"version": [str(part) for part in version], "views": views}
    values |= {"intrinsics": [intrinsic], "poses": poses}
    if points:
        values["structure"] = [
            {
                "landmarkId": str(n), "descType": "sift", "color": ["10", "20", "30"],
                "X": _row(position).split(),
                "observations": [{"observationId": str(500 + number)} for number in seen],
            }
            for n, (position, seen) in enumerate(points)
        ]  # fmt: skip
    folder.joinpath(name).write_text(json.dumps(values, indent=1))
