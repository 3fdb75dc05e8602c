# SPDX-License-Identifier: Apache-2.0
"""Scenarios are files: those of the package, and any folder or file of the user's own.

A file `name.yaml` holds `description` and any fields of `Scenario`, grouped as there; an
interval is written [low, high], never `null` where a field allows it. `extends: other` takes all
else from another scenario, which is looked for in the same folder, then in the package.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import yaml

from risk_dqn_planner.errors import ScenarioError
from sim_bridge.scenarios.fields import Interval, Scenario

__all__ = ["PACKAGE_FOLDER", "Scenario", "load_scenario", "scenario_names"]

PACKAGE_FOLDER = Path(__file__).resolve().parent


def scenario_names() -> list[str]:
    """Return the names of the scenarios of the package, sorted."""
    return sorted(path.stem for path in PACKAGE_FOLDER.glob("*.yaml"))


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load a scenario of the package by its name, or one from a .yaml file.

    Raises:
        ScenarioError: unknown name, unreadable file, unknown or invalid field; says which.
    """
    path = Path(name_or_path)
    if path.suffix != ".yaml":
        path = PACKAGE_FOLDER / f"{name_or_path}.yaml"
        if not path.is_file():
            known = ", ".join(scenario_names())
            raise ScenarioError(f"there is no scenario '{name_or_path}', expected one of: {known}")
    content = _read(path, ())
    content.setdefault("description", "")
    scenario: Scenario = _build(Scenario, {"name": path.stem, **content}, path, "")
    return scenario


def _read(path: Path, extended_by: tuple[Path, ...]) -> dict[str, Any]:
    """Return the content of a file merged over what it extends."""
    if path in extended_by:
        raise ScenarioError(f"{path} extends itself")
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as err:
        raise ScenarioError(f"cannot read scenario file {path}: {err}") from err
    if not isinstance(content, dict):
        raise ScenarioError(f"{path} holds no fields, expected a mapping of names to values")
    if "extends" not in content:
        return content
    parent = str(content.pop("extends"))
    folders = (path.parent, PACKAGE_FOLDER)
    found = [folder / f"{parent}.yaml" for folder in folders]
    found = [candidate for candidate in found if candidate.is_file()]
    if not found:
        raise ScenarioError(f"{path} extends '{parent}', which is in neither of {folders}")
    inherited = _read(found[0], (*extended_by, path))
    inherited.pop("description", None)
    return _merged(inherited, content)


def _merged(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    result = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = _merged(result[key], value) if both else value
    return result


def _build(kind: Any, content: Mapping[str, Any], path: Path, where: str) -> Any:  # noqa: ANN401 (any group)
    """Build a dataclass from the mapping at `where` of a file, errors naming file and field."""
    types = get_type_hints(kind)
    known = {field.name for field in fields(kind)}
    unknown = sorted(set(content) - known)
    if unknown:
        raise ScenarioError(
            f"{path}: there is no field {where}{unknown[0]}, expected one of: "
            + ", ".join(sorted(known))
        )
    values = {
        name: _convert_or_none(types[name], value, path, where + name)
        for name, value in content.items()
    }
    try:
        return kind(**values)
    except ScenarioError as err:
        raise ScenarioError(f"{path}: {err}") from err


def _convert_or_none(kind: Any, value: Any, path: Path, where: str) -> Any:  # noqa: ANN401 (any field)
    """Convert a value of a file to the type of its field, which may allow None."""
    allowed = get_args(kind)
    if type(None) not in allowed:
        return _convert(kind, value, path, where)
    return None if value is None else _convert(allowed[0], value, path, where)


def _convert(kind: Any, value: Any, path: Path, where: str) -> Any:  # noqa: ANN401 (any field)
    """Convert a value of a file to the type of its field."""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if kind is Interval:
        pair = isinstance(value, list) and len(value) == 2
        if pair and all(isinstance(x, int | float) and not isinstance(x, bool) for x in value):
            try:
                return Interval(float(value[0]), float(value[1]))
            except ScenarioError as err:
                raise ScenarioError(f"{path}: {where}: {err}") from err
        expected = "[low, high]"
    elif is_dataclass(kind):
        if isinstance(value, dict):
            return _build(kind, value, path, f"{where}.")
        expected = "a group of fields"
    elif kind is float:
        if number:
            return float(value)
        expected = "a number"
    else:
        if isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
            return value
        expected = {int: "a whole number", bool: "true or false"}.get(kind, "text")
    raise ScenarioError(f"{path}: {where} is {value!r}, expected {expected}")
