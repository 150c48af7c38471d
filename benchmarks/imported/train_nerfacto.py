"""Small nerfacto checkpoints, trained on the CPU by nerfstudio's own code, with pictures that it renders.

    pip install nerfstudio
    cagefield make-scene chair -o DATA --size 100 --views 20 --test-views 2
    python -m benchmarks.imported.train_nerfacto DATA -o OUT --layout blender
    python -m benchmarks.imported.train_nerfacto ROOM -o OUT --layout nerfstudio

Model, losses, sampling, config.yml and checkpoint are nerfstudio's; the loop below only steps optimizers.
Beside the checkpoint's folder, renders.npz has views as nerfstudio renders them: rgbN [H,W,3], accN [H,W,1],
c2wN [3,4] and kN (fx, fy, cx, cy, width, height). step-*_pictures.npz has rgb [V,H,W,3], c2w
[V,4,4] and lens [V,6] for `external_fields`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import torch

VIEWS = 2


def main() -> None:
    """Trains, saves, renders."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--layout", choices=("blender", "nerfstudio"), default="blender")
    parser.add_argument("--iterations", type=int, default=400)
    options = parser.parse_args()
    torch.manual_seed(0)
    np.random.seed(0)
    config = _config(options)
    config.save_config()
    config.pipeline.datamanager.data = options.data
    pipeline = config.pipeline.setup(device="cpu", test_mode="test", world_size=1, local_rank=0)
    folder = config.get_base_dir()
    pipeline.datamanager.train_dataparser_outputs.save_dataparser_transform(
        folder / "dataparser_transforms.json"
    )
    optimizers = _train(pipeline, options.iterations)
    _save(config, pipeline, optimizers, options.iterations)
    views = _renders(pipeline)
    np.savez(folder / "renders.npz", **views)
    pictures = np.stack([views[f"rgb{index}"] for index in range(len(views) // 4)])
    models = folder / "nerfstudio_models"
    poses = np.stack([np.vstack([views[f"c2w{index}"], [0, 0, 0, 1]]) for index in range(len(pictures))])
    lenses = np.stack([views[f"k{index}"] for index in range(len(pictures))])
    beside = models / f"step-{options.iterations - 1:09d}_pictures.npz"
    np.savez(beside, rgb=pictures, c2w=poses, lens=lenses)
    print(folder)


def _config(options: argparse.Namespace) -> Any:
    from nerfstudio.cameras.camera_optimizers import CameraOptimizerConfig
    from nerfstudio.data.datamanagers.base_datamanager import VanillaDataManagerConfig
    from nerfstudio.data.dataparsers.blender_dataparser import BlenderDataParserConfig
    from nerfstudio.data.dataparsers.nerfstudio_dataparser import NerfstudioDataParserConfig
    from nerfstudio.engine.trainer import TrainerConfig
    from nerfstudio.models.nerfacto import NerfactoModelConfig
    from nerfstudio.pipelines.base_pipeline import VanillaPipelineConfig

    proposal = {"hidden_dim": 16, "log2_hashmap_size": 11, "num_levels": 5, "use_linear": False}
    model = {
        "implementation": "torch",
        "log2_hashmap_size": 12,
        "num_levels": 8,
        "max_res": 256,
        "average_init_density": 0.01,
        "proposal_net_args_list": [{**proposal, "max_res": 128}, {**proposal, "max_res": 256}],
        "num_proposal_samples_per_ray": (64, 48),
        "num_nerf_samples_per_ray": 32,
        "eval_num_rays_per_chunk": 2048,
        "camera_optimizer": CameraOptimizerConfig(mode="off"),
    }
    parser: Any = NerfstudioDataParserConfig(data=options.data)
    if options.layout == "blender":
        parser = BlenderDataParserConfig(data=options.data)
        model |= {
            "disable_scene_contraction": True,
            "far_plane": 12.0,
            "background_color": "white",
            "proposal_initial_sampler": "uniform",
            "use_appearance_embedding": False,
        }
    manager = VanillaDataManagerConfig(dataparser=parser, train_num_rays_per_batch=512)
    return TrainerConfig(
        method_name="nerfacto",
        output_dir=options.out,
        experiment_name=options.layout,
        timestamp="run",
        data=options.data,
        max_num_iterations=options.iterations,
        mixed_precision=False,
        pipeline=VanillaPipelineConfig(datamanager=manager, model=NerfactoModelConfig(**model)),
    )


def _train(pipeline: Any, iterations: int) -> dict[str, torch.optim.Optimizer]:
    from nerfstudio.engine.callbacks import TrainingCallbackAttributes, TrainingCallbackLocation

    groups = pipeline.get_param_groups()
    optimizers: dict[str, torch.optim.Optimizer] = {
        name: torch.optim.Adam(groups[name], lr=1e-2, eps=1e-15) for name in ("fields", "proposal_networks")
    }
    attributes = TrainingCallbackAttributes(
        optimizers=None, grad_scaler=None, pipeline=pipeline, trainer=None
    )
    callbacks = pipeline.get_training_callbacks(attributes)
    before = TrainingCallbackLocation.BEFORE_TRAIN_ITERATION
    after = TrainingCallbackLocation.AFTER_TRAIN_ITERATION
    pipeline.train()
    for step in range(iterations):
        for callback in callbacks:
            callback.run_callback_at_location(step, location=before)
        for optimizer in optimizers.values():
            optimizer.zero_grad()
        losses = pipeline.get_train_loss_dict(step=step)[1]
        sum(losses.values()).backward()
        for optimizer in optimizers.values():
            optimizer.step()
        for callback in callbacks:
            callback.run_callback_at_location(step, location=after)
    return optimizers


def _save(config: Any, pipeline: Any, optimizers: dict[str, Any], iterations: int) -> None:
    """The checkpoint by nerfstudio's own method."""
    from nerfstudio.engine.trainer import Trainer

    trainer: Any = SimpleNamespace(
        checkpoint_dir=config.get_base_dir() / "nerfstudio_models",
        pipeline=pipeline,
        config=config,
        optimizers=SimpleNamespace(optimizers=optimizers, schedulers={}),
        grad_scaler=torch.amp.GradScaler("cpu", enabled=False),
    )
    save = getattr(Trainer.save_checkpoint, "__wrapped__", Trainer.save_checkpoint)
    save(trainer, iterations - 1)


def _renders(pipeline: Any) -> dict[str, Any]:
    """Views of the evaluation set, by the model as it is after loading: proposals are not annealed."""
    pipeline.eval()
    pipeline.model.proposal_sampler.set_anneal(1.0)
    cameras, found = pipeline.datamanager.eval_dataset.cameras, {}
    cameras.distortion_params = None  # pinholes, as `Camera`
    for index in range(min(VIEWS, len(cameras))):
        with torch.no_grad():
            outputs = pipeline.model.get_outputs_for_camera(cameras[index : index + 1])
        camera = cameras[index]
        found[f"rgb{index}"], found[f"acc{index}"] = outputs["rgb"].numpy(), outputs["accumulation"].numpy()
        found[f"c2w{index}"] = camera.camera_to_worlds.numpy()
        numbers = (camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height)
        found[f"k{index}"] = np.array([float(number) for number in numbers])
    return found


if __name__ == "__main__":
    main()
