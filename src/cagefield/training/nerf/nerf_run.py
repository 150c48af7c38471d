"""State of a NerfField's training run."""

from __future__ import annotations

import dataclasses
import errno
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from cagefield.cameras.camera import Camera
from cagefield.datasets.views import Dataset, View
from cagefield.errors import CagefieldError, FieldError
from cagefield.fields.mlp import Linear, Mlp
from cagefield.fields.nerf_field import NerfField
from cagefield.fields.nerf_torch import TorchMlp, TorchNerf, torch_device
from cagefield.files.atomic import replaced_file
from cagefield.formats.torch_files import read_torch_tensors
from cagefield.rendering.nerf.nerf_renderer import Jitter, Rays, march
from cagefield.training.checkpoint import signature_options
from cagefield.training.checkpoint_checks import check_run
from cagefield.training.evaluation import composite_on_white
from cagefield.training.nerf.nerf_config import CHECKPOINT_KEYS, NerfConfig
from cagefield.training.nerf.nerf_space import build_sampling_space

SKIP_LAYER = 5
"""Trunk layer whose input includes the encoded position again."""

FINAL_LR_SHARE = 0.1
"""Learning rate after `lr_decay_steps` steps, as a share of the initial one."""

INITIAL_OPTICAL_DEPTH = 0.5
"""Optical depth of an untrained field across its box; zero density has no gradient."""

DENSITY_SAMPLES = 4096
"""Number of points at which the untrained density is sampled."""

PHOTOS_PER_BATCH = 8
"""Maximum number of photos per batch of an unbounded capture."""


@dataclass(frozen=True)
class NerfProgress:
    """Progress of a run: `done` in [0,1], step, running PSNR of the fine network, rays/s, seconds."""

    done: float
    step: int
    psnr: float
    rays_per_second: float
    seconds: float

    def __str__(self) -> str:
        return f"step {self.step}, PSNR {self.psnr:.1f} dB, {self.rays_per_second / 1e3:.2f} k rays/s"


class NerfRun:
    """Training run of a NerfField; a `loop.Run`."""

    def __init__(self, dataset: Dataset, config: NerfConfig) -> None:
        self.config, self.space = config, build_sampling_space(dataset, config.ndc)
        self.dataset = dataset = self.space.dataset
        self.device = torch_device()
        self.bfloat16 = config.bfloat16
        if self.bfloat16 is None:
            self.bfloat16 = self.device.type == "cuda" and torch.cuda.is_bf16_supported()
        torch.manual_seed(config.seed)
        rng = np.random.default_rng(config.seed)
        noise = (1.0 if dataset.unbounded else 0.0) if config.raw_noise_std is None else config.raw_noise_std
        self.jitter = Jitter(noise)
        own_box = dataset.bounds if self.space.ndc is None else np.array([[-1.0] * 3, [1.0] * 3])
        self.start = NerfField(
            build_initial_network(config, rng, own_box),
            build_initial_network(config, rng, own_box) if config.samples[1] else None,
            dataset.bounds,
            self.space.near,
            self.space.far,
            config.samples,
            self.space.lindisp,
            self.space.ndc,
            bounded=not dataset.unbounded,
        )
        self.torch = TorchNerf(self.start, self.device, trainable=True)
        self.optimizer = torch.optim.Adam(self.torch.parameters, lr=config.lr)
        self.photos = [
            torch.from_numpy(composite_on_white(view.load())).to(self.device) for view in dataset.train
        ]
        self.pixel_indices = [_valid_pixel_indices(view) for view in dataset.train]
        self.white = dataset.train[0].load().shape[2] == 4
        self.step, self.seconds, self.loss = 0, 0.0, float("nan")

    @property
    def done(self) -> float:
        """Progress of the run, 0 to 1."""
        if self.config.minutes is not None:
            return min(1.0, self.seconds / (60.0 * self.config.minutes))
        return min(1.0, self.step / self.config.steps)

    def advance(self) -> None:
        """Take one step."""
        began = time.perf_counter()
        config = self.config
        passed = self.done if config.lr_decay_steps is None else self.step / config.lr_decay_steps
        for group in self.optimizer.param_groups:
            group["lr"] = config.lr * FINAL_LR_SHARE**passed
        rays, target = self.next_batch()
        with torch.autocast(self.device.type, dtype=torch.bfloat16, enabled=self.bfloat16):
            coarse, fine = march(self.torch, rays, jitter=self.jitter)
        background = 1.0 if self.white else 0.0
        errors = [
            ((sums.premultiplied + background * (1.0 - sums.opacity[:, None]) - target) ** 2).mean()
            for sums in (coarse, fine)
        ]
        self.optimizer.zero_grad(set_to_none=True)
        (errors[0] + errors[1]).backward()
        self.optimizer.step()
        self.step += 1
        if self.step % 10 == 1 or self.loss != self.loss:
            now = float(errors[1].detach())
            self.loss = now if self.loss != self.loss else 0.8 * self.loss + 0.2 * now
        self.seconds += time.perf_counter() - began

    def next_batch(self) -> tuple[Rays, Tensor]:
        """Random rays [N] of one or several photos, and the photos' colors [N,3]."""
        rng = np.random.default_rng((self.config.seed, self.step))
        count, unbounded = self.config.batch_rays, self.dataset.unbounded
        photos = min(PHOTOS_PER_BATCH, count) if unbounded else 1
        middle = not unbounded and self.step < self.config.precrop_steps
        parts = [self._rays(rng, len(rows), middle) for rows in np.array_split(np.arange(count), photos)]
        rays, targets = zip(*parts, strict=True)
        return Rays(*(torch.cat(column) for column in zip(*rays, strict=True))), torch.cat(targets)

    def _rays(self, rng: np.random.Generator, count: int, middle: bool) -> tuple[Rays, Tensor]:
        """`count` rays of a random photo, or of its middle half, and the photo's colors [count,3]."""
        number = int(rng.integers(len(self.photos)))
        camera: Camera = self.dataset.train[number].camera
        columns, rows = camera.width, camera.height
        low_i, low_j = (columns // 4, rows // 4) if middle else (0, 0)
        pixel_indices = self.pixel_indices[number]
        if pixel_indices is None:
            i = rng.integers(low_i, columns - low_i, count)
            j = rng.integers(low_j, rows - low_j, count)
        else:
            within = (
                np.abs(pixel_indices - (0.5 * columns, 0.5 * rows)) <= (0.25 * columns, 0.25 * rows)
            ).all(axis=1)
            some = pixel_indices[within] if middle and within.any() else pixel_indices
            i, j = some[rng.integers(0, len(some), count)].T
        target = self.photos[number][torch.from_numpy(j).to(self.device), torch.from_numpy(i).to(self.device)]
        return Rays.from_camera(camera, self.device, np.stack([i, j], axis=1)), target

    def progress(self) -> NerfProgress:
        """Progress report of the run."""
        psnr = -10.0 * np.log10(max(self.loss, 1e-10)) if self.loss == self.loss else float("nan")
        rate = self.step * self.config.batch_rays / max(self.seconds, 1e-9)
        return NerfProgress(self.done, self.step, float(psnr), rate, self.seconds)

    def field(self) -> NerfField:
        """Current field."""
        fine = None if self.torch.fine is None else _as_mlp(self.torch.fine)
        return dataclasses.replace(
            self.start,
            coarse=_as_mlp(self.torch.coarse),
            fine=fine,
            samples=self.config.render_samples or self.config.samples,
        )

    def store(self, path: Path) -> None:
        """Write the state of the run to `path`, whole or not at all."""
        state = {
            "config": repr(self._options()),
            "step": self.step,
            "seconds": self.seconds,
            "loss": self.loss,
            "parameters": [values.detach().cpu() for values in self.torch.parameters],
            "optimizer": self.optimizer.state_dict(),
        }
        with replaced_file(path) as draft, draft.open("wb") as out:
            try:
                torch.save(state, out)
            except RuntimeError as error:  # PyTorch reports a failed write as a RuntimeError
                raise (
                    error.__context__
                    if isinstance(error.__context__, OSError)
                    else OSError(errno.EIO, " ".join(str(error).split())[:120])
                ) from None

    def restore(self, path: Path) -> None:
        """Restore the state in `path`."""
        try:
            state = _read_state(path)
            if state["config"] != repr(self._options()):
                raise CagefieldError(
                    f"{path} was written with other options or photos; give the same ones, or start anew"
                )
            with torch.no_grad():
                for own, values in zip(self.torch.parameters, state["parameters"], strict=True):
                    own.copy_(values)
            # Learning rates come from this run; the saved state has the moments of the gradients.
            settings = self.optimizer.state_dict()
            self.optimizer.load_state_dict({**settings, "state": state["optimizer"]["state"]})
            for parameter, sums in self.optimizer.state.items():
                self._check_sums(parameter, sums)
            check_run(state, "loss")
            self.step, self.seconds, self.loss = state["step"], state["seconds"], state["loss"]
        except CagefieldError:
            raise
        except Exception as error:
            reason = " ".join(str(error).split())[:120]
            raise CagefieldError(
                f"{path} is no checkpoint of this training ({reason}); start anew"
            ) from error
        torch.manual_seed(self.config.seed + self.step)

    def _check_sums(self, parameter: Tensor, sums: dict[str, Any]) -> None:
        """Check that `sums` can be Adam's state of the parameter. Raises ValueError."""
        moments = [sums["exp_avg"], sums["exp_avg_sq"]]
        fits = all(isinstance(each, Tensor) and each.shape == parameter.shape for each in moments)
        step = sums["step"]
        if not fits or not isinstance(step, Tensor) or step.shape != () or not 0 <= float(step) < 2**53:
            raise ValueError("sums of gradients of other networks")

    def _options(self) -> dict[str, Any]:
        """Options and photos that a checkpoint must share with this run."""
        options = signature_options(self.config, CHECKPOINT_KEYS)
        for name in ("steps", "minutes", "decay", "shown_samples"):
            del options[name]
        return {**options, "views": [view.name for view in self.dataset.train]}


def _read_state(path: Path) -> dict[str, Any]:
    """Contents of a file written by `NerfRun.store`, on the CPU. Raises ValueError for a damaged file."""
    try:
        return read_torch_tensors(path)
    except FieldError as error:
        raise ValueError(str(error).removeprefix(f"{path}: ")) from error


def build_initial_network(config: NerfConfig, rng: np.random.Generator, box: NDArray[Any]) -> Mlp:
    """Untrained network with weights and biases uniform within 1/sqrt(inputs), as PyTorch initializes layers.

    The bias of the density is then shifted so that thin fog of INITIAL_OPTICAL_DEPTH fills the box [2,3].
    Without the shift, two networks of five are empty everywhere, and zero density has no gradient.
    """
    encoded, seen = 3 + 6 * config.octaves[0], 3 + 6 * config.octaves[1]

    def linear(outputs: int, inputs: int) -> Linear:
        limit = inputs**-0.5
        weight = rng.uniform(-limit, limit, (outputs, inputs))
        return Linear(weight.astype(np.float32), rng.uniform(-limit, limit, outputs).astype(np.float32))

    width = config.width
    trunk = [linear(width, encoded)]
    for index in range(1, config.depth):
        trunk.append(linear(width, width + (encoded if index == SKIP_LAYER else 0)))
    pixel_indices = Mlp(
        trunk=tuple(trunk),
        density=linear(1, width),
        rgb=linear(3, width // 2),
        feature=linear(width, width),
        view=(linear(width // 2, width + seen),),
    )
    positions = torch.from_numpy(rng.uniform(box[0], box[1], (DENSITY_SAMPLES, 3)).astype(np.float32))
    with torch.no_grad():
        median = TorchMlp(pixel_indices, positions.device).trunk(positions)[0].median()
    fog = INITIAL_OPTICAL_DEPTH / float(np.mean(box[1] - box[0]))
    weight, bias = pixel_indices.density.weight, pixel_indices.density.bias
    return dataclasses.replace(pixel_indices, density=Linear(weight, bias + np.float32(fog - float(median))))


def _valid_pixel_indices(view: View) -> NDArray[np.int64] | None:
    """(column, row) [N,2] of a photo's valid pixels; None where every pixel is valid."""
    valid = view.valid_pixels()
    return None if valid is None else np.argwhere(valid)[:, ::-1]


def _as_mlp(network: TorchMlp) -> Mlp:
    layers = {name: Linear(*pair, name) for name, pair in network.arrays().items()}
    old = network.mlp
    return dataclasses.replace(
        old,
        trunk=tuple(layers[f"trunk.{index}"] for index in range(len(old.trunk))),
        view=tuple(layers[f"view.{index}"] for index in range(len(old.view))),
        density=layers["density"],
        rgb=layers["rgb"],
        feature=layers.get("feature"),
    )
