"""Checkpoints of other programs."""

from __future__ import annotations

from pathlib import Path

from splat_scenes import ball_of_splats


def write_checkpoints(folder: Path, splats: int = 50) -> None:
    """nerf-pytorch's two layouts, a.tar and a.ckpt, and splatfacto's of so many splats, s.ckpt."""
    import numpy as np
    import torch

    from nerf_networks import krrish94_state, yenchenlin_state
    from splat_damage import checkpoint_of

    def tensors(state: dict[str, np.ndarray]) -> dict[str, torch.Tensor]:
        return {name: torch.from_numpy(value) for name, value in state.items()}

    network = tensors(yenchenlin_state(0, width=8, depth=4))
    torch.save({"global_step": 5, "network_fn_state_dict": network}, folder / "a.tar")
    torch.save({"iter": 9, "model_coarse_state_dict": tensors(krrish94_state(0))}, folder / "a.ckpt")
    (folder / "s.ckpt").write_bytes(checkpoint_of(ball_of_splats(splats)))
