"""A bare page in headless Chromium that draws fields with its own GPU, as exported scenes do."""

from __future__ import annotations

import base64
import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import cagefield
from cagefield.cameras.camera import Camera
from chromium import chromium_context
from editor_page import USUAL

VIEWER = Path(cagefield.__file__).parent / "pages" / "viewer" / "viewer.js"


@dataclass(frozen=True)
class Drawn:
    """A picture of the page: color [h,w,3] and opacity [h,w] in [0,1], depth [h,w], unit normals [h,w,3]."""

    rgb: NDArray[np.float64]
    opacity: NDArray[np.float64]
    depth: NDArray[np.float32]
    normals: NDArray[np.float64]
    seconds: float


@dataclass
class FieldPage:
    """An open page with one renderer, `r`, of voxels or of splats."""

    page: Any
    splats: bool = False

    def load(self, field: bytes) -> dict[str, Any]:
        """Loads a field; figures of it."""
        return dict(
            self.page.evaluate(
                """async (text) => {
                    const began = performance.now();
                    const seen = [];
                    await r.load(bytes(text), { onLevel: (n, of) => seen.push([n, of]) });
                    return { levels: seen, bytes: r.bytes, ms: performance.now() - began };
                }""",
                base64.b64encode(field).decode(),
            )
        )

    def edit(self, edits: bytes | None, *, changes: bool = False) -> None:
        """Puts edits in the place of those before, of which they may be `changes`."""
        text = None if edits is None else base64.b64encode(edits).decode()
        self.page.evaluate(
            """async ([text, changes, splats]) => {
                const { readEdits, readSplatEdits } = cagefieldViewer;
                const read = splats ? readSplatEdits : (file) => readEdits(file, changes ? window.had : null);
                window.had = text && await read(bytes(text));
                r.setEdits(window.had);
            }""",
            [text, changes, self.splats],
        )

    def lose_context(self) -> None:
        """Takes the GPU's context away, gives it back, and has the renderer restore what it shows."""
        self.page.evaluate(
            """async () => {
                const canvas = document.querySelector("canvas");
                const extension = gl.getExtension("WEBGL_lose_context");
                canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
                const event = (name) =>
                    new Promise((done) => canvas.addEventListener(name, done, { once: true }));
                const lost = event("webglcontextlost");
                extension.loseContext();
                await lost;
                const restored = event("webglcontextrestored");
                setTimeout(() => extension.restoreContext(), 50);
                await restored;
                await r.restore();
            }"""
        )

    def draw(self, camera: Camera, *, normals: bool = True, count: bool = False, repeat: int = 1) -> Drawn:
        """The picture of a camera, the last of `repeat`; counts in place of depth where they are wanted."""
        answer = self.page.evaluate(
            """([camera, normals, count, repeat]) => {
                r.setSize(camera.width, camera.height);
                r.setCamera(camera);
                r.render({ normals, count, sorted: true });
                const got0 = r.read(normals);
                const began = performance.now();
                for (let n = 1; n < repeat; n++) { r.render({ normals, count }); r.read(false); }
                const seconds = (performance.now() - began) / 1000 / Math.max(1, repeat - 1);
                const got = repeat > 1 ? r.read(normals) : got0;
                const text = (array) => array && base64(new Uint8Array(array.buffer));
                return { rgba: text(got.rgba), depth: text(got.depth), normals: text(got.normals), seconds };
            }""",
            [{**camera.to_dict(), "c2w": camera.c2w.ravel().tolist()}, normals, count, repeat],
        )
        shape = (camera.height, camera.width)
        rgba = _array(answer["rgba"], np.uint8).reshape(*shape, 4) / 255.0
        turned = np.zeros((*shape, 3))
        if normals:
            raw = _array(answer["normals"], np.uint8).reshape(*shape, 4)[..., :3] / 127.5 - 1.0
            length = np.linalg.norm(raw, axis=-1, keepdims=True)
            turned = np.where(length > 0.1, raw / np.maximum(length, 0.1), 0.0)
        depth = _array(answer["depth"], np.uint32 if count else np.float32).reshape(shape)
        return Drawn(rgba[..., :3], rgba[..., 3], depth, turned, float(answer["seconds"]))


@contextlib.contextmanager
def field_page(splats: bool = False, flags: Sequence[str] | None = None) -> Iterator[FieldPage]:
    """A bare page with a renderer; skips where there is no Chromium. The page's errors fail the test.

    flags: command line of a Chromium for this page alone; by default the process's, which draws in software.
    """
    complaints: list[str] = []
    with chromium_context(flags, viewport={"width": 200, "height": 150}) as context:
        page = context.new_page()
        page.set_default_timeout(300_000)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda said: complaints.append(said.text))
        page.set_content("<canvas></canvas>")
        page.add_script_tag(content=VIEWER.read_text())
        page.evaluate(_START, "SplatRenderer" if splats else "FieldRenderer")
        yield FieldPage(page, splats)
    left = [said for said in complaints if not any(word in said for word in USUAL)]
    assert left == [], left


def _array(text: str, kind: Any) -> NDArray[Any]:
    return np.frombuffer(base64.b64decode(text), kind)


_START = """(renderer) => {
    window.gl = document.querySelector("canvas").getContext("webgl2", { antialias: false });
    window.r = new cagefieldViewer[renderer](gl);
    window.bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
    window.base64 = (array) => {
        let text = "";
        const part = 32768;
        for (let n = 0; n < array.length; n += part)
            text += String.fromCharCode(...array.subarray(n, n + part));
        return btoa(text);
    };
}"""
