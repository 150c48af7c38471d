"""Every reader of files and messages: an honest seed, which of its files are damaged, and how it is read."""

from __future__ import annotations

from dataset_readers import DATASET_READERS
from editor_readers import EDITOR_READERS
from external_readers import EXTERNAL_NEED_TORCH, EXTERNAL_READERS
from hash_grid_readers import HASH_GRID_NEED_TORCH, HASH_GRID_READERS
from message_readers import MESSAGE_READERS
from network_readers import NETWORK_READERS
from poses_readers import POSES_READERS
from program_readers import PROGRAM_READERS
from reader_seeds import Reader
from scene_readers import SCENE_READERS
from splat_readers import SPLAT_READERS
from training_readers import TRAINING_READERS

READERS: dict[str, Reader] = {
    **SCENE_READERS,
    **NETWORK_READERS,
    **EXTERNAL_READERS,
    **HASH_GRID_READERS,
    **DATASET_READERS,
    **PROGRAM_READERS,
    **SPLAT_READERS,
    **POSES_READERS,
    **TRAINING_READERS,
    **EDITOR_READERS,
    **MESSAGE_READERS,
}
"""The readers, by what they read."""

NEED_TORCH = (
    "nerf .tar, new",
    "nerf .tar, old",
    "nerf .tar, imported",
    "nerf .ckpt, new",
    "nerf .ckpt, old",
    "splatfacto .ckpt",
    "splatfacto .ckpt, old",
    "training, nerf",
    *EXTERNAL_NEED_TORCH,
    *HASH_GRID_NEED_TORCH,
)

NEED_OPENSSL = ("certificate",)
