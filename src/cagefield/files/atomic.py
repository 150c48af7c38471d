"""Files and folders that appear whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
import stat
import warnings
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from cagefield.files.rename_exchange import exchange_names
from cagefield.files.stale_files import displaced_folders, hidden_name, is_hidden, remove_leftovers


def check_writable(path: Path, *, inside: bool = False) -> None:
    """Passes where a file or a folder may be made or replaced at `path`; its folder need not be there yet.

    With `inside` it is a folder, and files may be made in it. Raises OSError, that names `path`, where not:
    called before work whose result has to go there. Unfinished files of ended programs are removed.
    """
    path = path.absolute()
    folders = (path, *path.parents) if inside else path.parents
    folder = next((each for each in folders if each.exists()), Path("/"))
    remove_leftovers(path, inside=inside)
    remove_leftovers(folder / path.name)
    probe = folder / hidden_name(path, "part")
    with _naming(path, folder):
        handle = os.open(probe, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        try:
            try:
                os.write(handle, b"?")
            finally:
                os.close(handle)  # some file systems say only now that there is no room
        finally:
            os.unlink(probe)


@contextmanager
def replaced_file(path: Path, *, parents: bool = True) -> Iterator[Path]:
    """A temporary file beside `path`, same suffix: becomes `path` on success, is removed on failure.

    The folder is made where it is missing and `parents` is True. An OSError about the temporary file, or
    about none (a full disk), names `path`.
    """
    if parents:
        path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(hidden_name(path, "part"))
    try:
        with _naming(path, path.parent):
            os.close(os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600))
        with _naming(path, temporary):
            yield temporary
            umask = os.umask(0)
            os.umask(umask)
            temporary.chmod(0o666 & ~umask)
            temporary.replace(path)
    finally:
        with suppress(OSError):  # nor could it be made there, which is told
            temporary.unlink(missing_ok=True)


@contextmanager
def _naming(path: Path, hidden: Path) -> Iterator[None]:
    """An OSError that names nothing, or `hidden` or what lies in it, names `path` instead."""
    try:
        yield
    except OSError as error:
        names = (error.filename, error.filename2)  # two where a copy failed
        if names[0] is None or any(
            isinstance(name, (str, Path)) and Path(name).is_relative_to(hidden) for name in names
        ):
            error.filename, error.filename2 = str(path), None
            if error.errno is None:  # pillow's, which has words alone
                error.errno, error.strerror = errno.EIO, str(error.args[0]) if error.args else "failed"
                error.args = (error.errno, error.strerror)  # else pickle loses the names
        raise


@contextmanager
def merged_folder(target: Path) -> Iterator[Path]:
    """A folder to be filled with files that go into `target` once all of them are written.

    If `target` holds something, the files take their places one after another, each at once; after a failure
    before that `target` is unchanged. Otherwise the folder is `target` itself, not made yet or empty, and
    files stay there after a failure.
    """
    if not target.exists() or not any(target.iterdir()):
        yield target
        return
    target = target.resolve()
    remove_leftovers(target, inside=True)
    draft = target / hidden_name(target, "new")
    with _naming(target, target):
        draft.mkdir()
    try:
        with _naming(target, draft):
            yield draft
            for entry in sorted(draft.iterdir()):
                entry.replace(target / entry.name)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


@contextmanager
def replaced_folder(target: Path, own: Collection[str]) -> Iterator[Path]:
    """An empty folder beside `target` to be filled: takes its place on success, is removed on failure.

    Entries of `target` under the names in `own` go; other entries stand in the new folder, which has the
    rights of `target`, when it takes its place. After a failure `target` is unchanged.
    Where the system can exchange two names at once there is a whole folder at `target` at every moment; else
    `recover_folder`, which whoever calls this has called, puts back what an end between two renames left. An
    OSError about the new folder, or about none (a full disk), names `target`. A `target` that is itself such
    an empty folder beside another one, which removes it, is filled as it is.
    """
    if is_hidden(target) and target.is_dir() and not any(target.iterdir()):
        yield target
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(target)
    draft, retired = (target.with_name(hidden_name(target, role)) for role in ("new", "old"))
    with _naming(target, draft):
        draft.mkdir()
    try:
        with _naming(target, draft):
            yield draft
            others = _others(target, own)
            for entry in others:
                _linked(entry, draft / entry.name)
            if not target.exists():
                draft.rename(target)
            else:
                draft.chmod(stat.S_IMODE(target.stat().st_mode))
                if exchange_names(draft, target):
                    retired = draft
                else:
                    target.rename(retired)
                    draft.rename(target)
    except BaseException:
        if retired is not draft:
            shutil.rmtree(draft, ignore_errors=True)
            if retired.exists() and not target.exists():
                retired.rename(target)
        raise
    if retired.exists():
        for entry in _others(retired, own):  # made since others were linked
            if not (target / entry.name).exists():
                entry.rename(target / entry.name)
        shutil.rmtree(retired, ignore_errors=True)


def recover_folder(target: Path, is_whole: Callable[[Path], bool]) -> Path | None:
    """Puts back, where `target` is not there, the newest folder that an end between renames left beside it.

    Says so in a warning. The name that it had is returned, None where there was nothing to do. `is_whole`
    says which folders count.
    """
    if target.exists() or not target.parent.is_dir():
        return None
    left = [folder for folder in displaced_folders(target) if is_whole(folder)]
    if not left:
        return None
    newest = max(left, key=lambda folder: folder.stat().st_mtime)
    newest.rename(target)
    warnings.warn(
        f"{target} was left as {newest.name} by a program that was ended while it replaced it; it is back",
        stacklevel=2,
    )
    return newest


def _others(folder: Path, own: Collection[str]) -> list[Path]:
    """Entries of a folder other than the names in `own`."""
    return [] if not folder.is_dir() else [entry for entry in folder.iterdir() if entry.name not in own]


def _linked(entry: Path, copy: Path) -> None:
    """Another name of a file, or a folder with other names of its files; a copy where there are no links.

    Raises the first OSError, where `shutil.copytree` would try the other files and tell of all.
    """
    if entry.is_dir() and not entry.is_symlink():
        copy.mkdir()
        for part in entry.iterdir():
            _linked(part, copy / part.name)
        shutil.copystat(entry, copy)
        return
    try:
        os.link(entry, copy, follow_symlinks=False)
    except OSError:
        shutil.copy2(entry, copy, follow_symlinks=False)
