# SPDX-License-Identifier: Apache-2.0
"""Where compiled kernels are kept: a folder for each state of the sources they depend on.

numba notices a change of the file that holds a kernel, but not one of a kernel or constant that
it calls in another file: it would go on with the old one. So the folder's name is a digest of
all the project's files that the kernel's module can reach by its imports.
"""

import hashlib
import os
import re
import sys
from functools import cache
from pathlib import Path

_IMPORT = re.compile(
    r"^(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n#]*)|import\s+([\w.]+))", re.MULTILINE
)
_NAME = re.compile(r"\w+")
_THIS_PACKAGE = __name__.partition(".")[0]


def cache_folder(module: str) -> str:
    """Return the folder for a module's kernels; empty to leave the choice to numba.

    It lies in the package's `__pycache__`, as Python's own compiled files do. Where that
    cannot be written (a system installation) numba takes the user's cache folder; there
    sources do not change.
    """
    package = module.partition(".")[0]
    root = _package_folder(package)
    if root is None or not os.access(root, os.W_OK):
        return ""
    digest = hashlib.sha256()
    for path in sorted(reached_files(module)):
        digest.update(path.read_bytes())
    return str(root / "__pycache__" / "kernels" / digest.hexdigest()[:16])


def reached_files(module: str) -> frozenset[Path]:
    """Return the files of a module and of all it imports, directly or not.

    Only files of the module's own package and of this one count; others are installed, and
    numba's own check of versions is trusted there.
    """
    packages = {module.partition(".")[0], _THIS_PACKAGE}
    found: set[Path] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        path = _file(name) if name.partition(".")[0] in packages else None
        if path is not None and path not in found:
            found.add(path)
            waiting.extend(_imports(path))
    return frozenset(found)


def _package_folder(package: str) -> Path | None:
    """Return the folder of a top-level package, None if it is none."""
    file = getattr(sys.modules.get(package), "__file__", None)
    return Path(file).parent if file is not None and file.endswith("__init__.py") else None


@cache
def _file(module: str) -> Path | None:
    """Return the source file of a module, None where there is none."""
    package, *rest = module.split(".")
    root = _package_folder(package)
    if root is None:
        return None
    base = root.joinpath(*rest)
    candidates = (base.with_suffix(".py"), base / "__init__.py")
    return next((path for path in candidates if path.is_file()), None)


@cache
def _imports(path: Path) -> tuple[str, ...]:
    """Return the names of the modules that a file may import."""
    names: list[str] = []
    for source, imported, plain in _IMPORT.findall(path.read_text(encoding="utf-8")):
        names.append(source or plain)
        names.extend(f"{source}.{name}" for name in _NAME.findall(imported) if source)
    return tuple(names)
