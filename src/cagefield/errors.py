"""Errors that a user can act on: each names the value, the allowed range and the cure."""

from __future__ import annotations


class CagefieldError(ValueError):
    """Base of every error raised on bad input; the command line prints its message alone and exits with 2."""


class CageError(CagefieldError):
    """A cage whose corners are not a valid hexahedron."""


class EditError(CagefieldError):
    """An edit or an edit stack that cannot be evaluated."""


class EditFileError(EditError):
    """An edit file with an unknown key or an impossible value."""


class CameraError(CagefieldError):
    """A camera with impossible intrinsics or pose."""


class DatasetError(CagefieldError):
    """A data set that cannot be read."""


class FieldError(CagefieldError):
    """A field with arrays that do not fit together, or a field file that cannot be read."""


class SceneError(CagefieldError):
    """A scene folder that cannot be read or written."""


class DeviceError(CagefieldError):
    """A compute device that is not there."""
