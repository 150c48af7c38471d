"""Readers whose honest seeds are large, so that what reading one takes is what its file holds.

Readers of `readers.py` where a file's size can drive memory: beside small seeds SLACK hides what a damaged
file takes. Left out is what is small whenever it is honest: configs, tokens, locks, certificates, the
transform of a data parser, messages (1 MiB; the edits in one are read as those of a file), and videos, of
which ffmpeg reads the frames and this process the beginning.
"""

from __future__ import annotations

from functools import partial

from dataset_readers import colmap_readers, llff_reader, picture_readers, points_reader, transforms_reader
from large_external import LARGE_EXTERNAL_READERS
from network_readers import network_readers, training_reader
from poses_readers import work_readers
from reader_seeds import Reader, many_edits
from scene_readers import autosave_reader, edits_reader, field_readers, path_readers, scene_reader
from splat_readers import splat_readers
from training_readers import training_readers

_EDITS = partial(many_edits, 250, 40)

READERS: dict[str, Reader] = {
    "edits.yaml": edits_reader("yaml", partial(many_edits, 70, 60), ()),
    "edits.json": edits_reader("json", _EDITS, ()),
    "scene folder": scene_reader(6000),
    **field_readers(170, 180_000, 560),
    "autosave": autosave_reader(_EDITS),
    **path_readers(250, 100.0),
    **network_readers(512, 8, 640),
    "training": training_reader(80_000),
    "transforms.json": transforms_reader(5000),
    **colmap_readers(100, 30_000, 300),
    "LLFF": llff_reader(4000),
    "points.ply": points_reader(80_000),
    **picture_readers((1536, 1024)),
    **splat_readers(50_000, 100_000),
    **{name: splat_readers(16_000)[name] for name in ("sog", "sog folder")},
    "text ply": splat_readers(6000)["text ply"],
    **work_readers(4000, 180_000, 60_000, 100_000, 8000),
    **training_readers(80, 40_000, 512),
    **LARGE_EXTERNAL_READERS,
}
"""The readers, by their names in `readers.py`."""
