"""Binary messages to pages: a header in JSON, its length before it, and bytes behind it."""

from __future__ import annotations

from cagefield.server.protocol import server_messages
from cagefield.server.protocol.common import Message
from cagefield.server.render_queue.dispatcher import Stamp
from cagefield.server.render_queue.requests import EditsRequest, Request
from cagefield.server.render_worker.picks import Highlight
from cagefield.server.render_worker.refinement import FINAL
from cagefield.server.render_worker.tasks import EditsDone, Failed, PictureDone


def picture_message(request: Request, stamp: Stamp, done: PictureDone) -> bytes:
    """The binary message of a picture."""
    region = request.region
    header = server_messages.PictureHeader(
        picture=request.number,
        camera=request.camera,
        drag=stamp.drag,
        seq=stamp.seq,
        revision=stamp.revision,
        view=request.display.view,
        before=request.display.before,
        split=request.display.split,
        x=region.x,
        y=region.y,
        width=region.width,
        height=region.height,
        full_width=region.full_width,
        full_height=region.full_height,
        whole=request.last,
        refinement=done.refinement,
        final=request.last and done.refinement == FINAL,
        format=done.format,
        picture_bytes=len(done.picture),
        depth_bytes=len(done.depth),
        depth_width=done.depth_size[0],
        depth_height=done.depth_size[1],
        depth_scale=done.depth_scale,
        render_ms=1e3 * done.render_seconds,
        encode_ms=1e3 * done.encode_seconds,
    )
    return _binary(header, done.picture, done.depth)


def edits_message(request: EditsRequest, stamp: Stamp, done: EditsDone | Failed) -> bytes:
    """The binary message of edits."""
    header = server_messages.EditsHeader(
        picture=request.number,
        drag=stamp.drag,
        seq=stamp.seq,
        revision=stamp.revision,
        final=not isinstance(done, EditsDone) or done.refinement == FINAL,
        why=None if isinstance(done, EditsDone) else done.text,
        map_ms=1e3 * done.map_seconds if isinstance(done, EditsDone) else 0.0,
        encode_ms=1e3 * done.encode_seconds if isinstance(done, EditsDone) else 0.0,
    )
    return _binary(header, done.content if isinstance(done, EditsDone) else b"")


def highlight_message(highlight: Highlight) -> bytes:
    """The binary message of a highlight of selected elements."""
    header = server_messages.HighlightHeader(
        count=highlight.count, low=highlight.low, high=highlight.high, size=highlight.size
    )
    return _binary(header, highlight.points)


def _binary(header: Message, *parts: bytes) -> bytes:
    """A message of a header in JSON and bytes behind it."""
    text = header.model_dump_json().encode()
    return b"".join([len(text).to_bytes(4, "little"), text, *parts])
