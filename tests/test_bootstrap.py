# SPDX-License-Identifier: Apache-2.0
"""The set-up on machines that lack something, and what it repeats when something changed.

A stand-in for Python answers the set-up's questions, makes environments that hold nothing but
itself, and notes what pip and colcon were asked to do.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]

FAKE_PYTHON = """\
#!/bin/bash
case "$*" in
  "-m venv"*)
    for directory; do [[ $directory = /* ]] && break; done
    echo "$*" >> "$FAKE_CALLS"
    mkdir -p "$directory/bin" && cp "$0" "$directory/bin/python" ;;
  "-m pip install"*)
    echo "$*" >> "$FAKE_CALLS"
    [ -z "$FAKE_PIP_OUTPUT" ] || { echo "$FAKE_PIP_OUTPUT"; exit 1; } ;;
  *colcon_core*)
    echo "colcon" >> "$FAKE_CALLS"
    mkdir -p build && touch build/leftover
    [ -z "$FAKE_COLCON_FAILS" ] || { echo "CMake Error: no such type"; exit 1; }
    mkdir -p install/robot/share/robot && cp src/robot/package.xml install/robot/share/robot ;;
  *) echo "$FAKE_PROBE" ;;
esac
"""

PROBE = {
    "executable": "",
    "version": [3, 12],
    "implementation": "CPython",
    "venv": True,
    "headers": True,
    "rclpy": False,
    "lanelet2": False,
    "numpy": "",
}


@dataclass
class Machine:
    """A scratch repository on a machine with nothing but what a test puts there."""

    root: Path
    tools: Path
    variables: dict[str, str] = field(default_factory=dict)

    def install(self, *names: str) -> None:
        """Put real programs onto the PATH."""
        for name in names:
            link = self.tools / name
            link.unlink(missing_ok=True)
            link.symlink_to(shutil.which(name) or f"/missing/{name}")

    def install_python(self, name: str = "python3", **answers: object) -> Path:
        """Put a stand-in for Python onto the PATH."""
        python = self.tools / name
        python.write_text(FAKE_PYTHON)
        python.chmod(0o755)
        self.variables["FAKE_PROBE"] = json.dumps({**PROBE, "executable": str(python), **answers})
        return python

    def set_up(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Run tools/bootstrap.py."""
        environ = {
            "PATH": str(self.tools),
            "HOME": str(self.root),
            "FAKE_CALLS": str(self.root / "calls"),
            "ROS_FROM": "wheels",
            **self.variables,
        }
        return subprocess.run(
            [sys._base_executable, str(self.root / "tools" / "bootstrap.py"), *arguments],
            env={name: value for name, value in environ.items() if value},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    def calls(self) -> list[str]:
        """Return what pip, venv and colcon were asked since the last time."""
        record = self.root / "calls"
        lines = record.read_text().splitlines() if record.exists() else []
        record.unlink(missing_ok=True)
        return [next(name for name in ("venv", "pip", "colcon") if name in line) for line in lines]


@pytest.fixture
def machine(tmp_path: Path) -> Iterator[Machine]:
    root, tools = tmp_path / "repository", tmp_path / "bin"
    tools.mkdir()
    for name in ("tools", "requirements"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(REPOSITORY / name, root / name, ignore=ignored)
    package = root / "src" / "robot"
    for folder in ("msg", "launch", "robot"):
        (package / folder).mkdir(parents=True)
    (package / "package.xml").write_text("<package/>")
    (package / "msg" / "Pose.msg").write_text("float64 x_m\n")
    (package / "launch" / "drive.launch.py").write_text("")
    (package / "robot" / "node.py").write_text("")
    (root / "colcon.meta").write_text("{}")
    made = Machine(root, tools)
    made.install("bash", "cp", "mkdir", "touch", "make", "cc", "c++", "printenv")
    made.install_python()
    yield made
    # A made environment holds nothing worth keeping for pytest's own clean-up to trip over.
    shutil.rmtree(root / ".venv", ignore_errors=True)


def refused(result: subprocess.CompletedProcess[str]) -> str:
    """Return the one sentence of a refusal."""
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
    sentences = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
    assert len(sentences) == 1
    return sentences[0]


def test_a_missing_compiler_is_named_before_anything_is_installed(machine: Machine):
    (machine.tools / "c++").unlink()

    sentence = refused(machine.set_up())

    assert "Not found: C++ compiler" in sentence
    assert "apt install build-essential" in sentence
    assert machine.calls() == []


def test_a_folder_that_colcon_cannot_build_in_is_refused(machine: Machine):
    machine.root = machine.root.rename(machine.root.with_name("my repository"))

    assert "move it to another path" in refused(machine.set_up())


def test_a_requested_python_of_another_version_is_refused(machine: Machine):
    python = machine.install_python("old-python", version=[3, 9])
    machine.variables["PYTHON"] = str(python)

    sentence = refused(machine.set_up())

    assert "Python 3.10, 3.11 or 3.12 is needed" in sentence
    assert "is Python 3.9" in sentence


def test_a_requested_python_that_is_not_there_is_refused(machine: Machine):
    machine.variables["PYTHON"] = "/nowhere/python3"

    assert "PYTHON=/nowhere/python3 does not run" in refused(machine.set_up())


def test_a_python_too_new_for_the_wheels_is_refused_with_the_way_out(machine: Machine):
    machine.install_python(version=[3, 13])

    sentence = refused(machine.set_up())

    assert "is Python 3.13" in sentence
    assert "PYTHON=/path/to/python" in sentence


@pytest.mark.parametrize(
    ("missing", "package"), [("venv", "python3.12-venv"), ("headers", "python3.12-dev")]
)
def test_a_python_with_a_part_split_off_names_the_package(
    machine: Machine, missing: str, package: str
):
    machine.install_python(**{missing: False})

    assert f"sudo apt install {package}" in refused(machine.set_up())


def test_a_stand_in_on_the_path_that_fails_is_passed_over(machine: Machine):
    machine.install_python("python3.11", version=[3, 11])
    (machine.tools / "python3").write_text(
        "#!/bin/bash\necho 'not found in this version' >&2\nexit 127\n"
    )

    assert machine.set_up("--no-build").returncode == 0


def test_a_start_with_a_python_older_than_the_set_up_itself_is_refused(machine: Machine):
    script = machine.root / "tools" / "bootstrap.py"
    pretend = f"import runpy, sys; sys.version_info = (3, 6, 9); runpy.run_path({str(script)!r})"

    result = subprocess.run(
        [sys._base_executable, "-c", pretend], capture_output=True, text=True, check=False
    )

    assert "python3 here is 3.6" in refused(result)


def test_another_sourced_ros_is_refused_with_the_way_out(machine: Machine):
    machine.variables.update(ROS_DISTRO="humble", ROS_FROM="")

    sentence = refused(machine.set_up())

    assert "ROS 'humble' is sourced" in sentence
    assert "ROS_FROM=wheels" in sentence


@pytest.mark.parametrize(
    ("output", "advice"),
    [
        ("Failed to establish a new connection: Name or service not known", "connect to the netw"),
        ("ERROR: Could not install packages: [Errno 28] No space left on device", "make room"),
        ("ERROR: No matching distribution found for rich==15.0.0", "(No matching distribution"),
    ],
)
def test_a_failing_pip_is_explained_and_its_log_named(machine: Machine, output: str, advice: str):
    machine.variables["FAKE_PIP_OUTPUT"] = output

    sentence = refused(machine.set_up())

    assert advice in sentence
    log = machine.root / "log" / "setup" / "pip.log"
    assert str(log) in sentence
    assert output in log.read_text()


def test_a_set_up_that_pip_did_not_complete_starts_from_an_empty_environment(machine: Machine):
    machine.variables["FAKE_PIP_OUTPUT"] = "killed"
    machine.set_up("--no-build")
    half_installed = machine.root / ".venv" / "half-installed"
    half_installed.touch()
    machine.calls()
    machine.variables["FAKE_PIP_OUTPUT"] = ""

    assert machine.set_up("--no-build").returncode == 0

    assert machine.calls() == ["venv", "pip"]
    assert not half_installed.exists()


def test_nothing_is_repeated_when_nothing_changed(machine: Machine):
    assert machine.set_up().returncode == 0
    assert machine.calls() == ["venv", "pip", "colcon"]

    again = machine.set_up()

    assert again.returncode == 0
    assert again.stderr == ""
    assert machine.calls() == []


@pytest.mark.parametrize(
    ("name", "calls"), [("development.txt", ["pip"]), ("python.txt", ["pip", "colcon"])]
)
def test_a_changed_requirement_is_installed_into_the_same_environment(
    machine: Machine, name: str, calls: list[str]
):
    machine.set_up()
    machine.calls()
    with (machine.root / "requirements" / name).open("a") as requirements:
        requirements.write("tabulate==0.9.0\n")

    machine.set_up()

    assert machine.calls() == calls


def test_another_python_makes_the_environment_anew(machine: Machine):
    machine.set_up("--no-build")
    machine.calls()
    machine.variables["PYTHON"] = str(machine.install_python("python3.11", version=[3, 11]))

    machine.set_up("--no-build")
    machine.set_up("--no-build")

    assert machine.calls() == ["venv", "pip"]


@pytest.mark.parametrize(
    ("path", "content", "rebuilt"),
    [
        ("robot/node.py", "pass\n", False),
        ("robot/planner.py", "new module\n", False),
        ("launch/drive.launch.py", "pass\n", False),
        ("launch/park.launch.py", "", True),
        ("msg/Pose.msg", "float32 x_m\n", True),
        ("package.xml", "<package format='3'/>", True),
    ],
)
def test_only_what_links_do_not_cover_needs_a_build(
    machine: Machine, path: str, content: str, rebuilt: bool
):
    machine.set_up()
    machine.calls()
    (machine.root / "src" / "robot" / path).write_text(content)

    machine.set_up()

    assert machine.calls() == (["colcon"] if rebuilt else [])
    # What was built is built upon.
    assert (machine.root / "build" / "leftover").exists()


@pytest.mark.parametrize("reason", ["file removed", "build cut short"])
def test_a_build_that_cannot_be_built_upon_starts_from_nothing(machine: Machine, reason: str):
    machine.set_up()
    stale = machine.root / "install" / "stale"
    stale.touch()
    if reason == "file removed":
        (machine.root / "src" / "robot" / "launch" / "drive.launch.py").unlink()
    else:
        stamp = machine.root / "build" / "workspace.json"
        content = json.loads(stamp.read_text())
        stamp.write_text(json.dumps({**content, "complete": False, "running": True}))
    machine.calls()

    assert machine.set_up().returncode == 0

    assert machine.calls() == ["colcon"]
    assert not stale.exists()


def test_a_failing_build_names_its_log_and_is_tried_again(machine: Machine):
    machine.variables["FAKE_COLCON_FAILS"] = "1"
    log = machine.root / "log" / "setup" / "colcon.log"

    assert str(log) in refused(machine.set_up())
    assert "no such type" in log.read_text()

    machine.variables["FAKE_COLCON_FAILS"] = ""
    assert machine.set_up().returncode == 0


def test_a_command_runs_with_ros_and_without_a_foreign_pythonpath(machine: Machine):
    machine.variables["PYTHONPATH"] = "/foreign"

    ros = machine.set_up("--no-build", "--", "printenv", "ROS_DISTRO", "AMENT_PREFIX_PATH")
    foreign = machine.set_up("--no-build", "--", "printenv", "PYTHONPATH")

    assert ros.stdout.split() == ["jazzy", str(machine.root / ".venv")]
    assert foreign.stdout == ""


def test_a_command_that_fails_passes_its_exit_code_on(machine: Machine):
    assert machine.set_up("--no-build", "--", "bash", "-c", "exit 7").returncode == 7


def test_a_sourced_jazzy_is_used_with_its_own_python_and_numpy(machine: Machine):
    prefix = machine.root.parent / "jazzy"
    (prefix / "share" / "rclpy").mkdir(parents=True)
    (prefix / "share" / "rclpy" / "package.xml").touch()
    python = machine.install_python("ros-python", rclpy=True, lanelet2=True, numpy="1.26.4")
    machine.install("cmake")
    machine.variables.update(
        ROS_FROM="", ROS_DISTRO="jazzy", AMENT_PREFIX_PATH=str(prefix), PYTHON=str(python)
    )

    result = machine.set_up("--no-build", "--", "printenv", "AMENT_PREFIX_PATH")

    assert result.stdout.strip() == str(prefix)
    asked = (machine.root / "calls").read_text()
    assert "--system-site-packages" in asked
    assert "ros-jazzy.txt" not in asked
    assert "lanelet2" not in asked
    constraints = machine.root / ".venv" / "constraints.txt"
    assert constraints.read_text() == "numpy==1.26.4\n"


def test_a_sourced_jazzy_that_no_python_can_import_is_refused(machine: Machine):
    prefix = machine.root.parent / "jazzy"
    (prefix / "share" / "rclpy").mkdir(parents=True)
    (prefix / "share" / "rclpy" / "package.xml").touch()
    python = machine.install_python("ros-python", rclpy=False)
    machine.install("cmake")
    machine.variables.update(
        ROS_FROM="", ROS_DISTRO="jazzy", AMENT_PREFIX_PATH=str(prefix), PYTHON=str(python)
    )

    assert "cannot import rclpy" in refused(machine.set_up())


@pytest.mark.skipif(Path("/opt/ros/jazzy").is_dir(), reason="an installed Jazzy goes first")
def test_the_environment_is_not_taken_for_a_sourced_ros_in_its_own_shell(machine: Machine):
    machine.set_up("--no-build")
    machine.calls()
    own = machine.root / ".venv"
    (own / "share" / "rclpy").mkdir(parents=True)
    (own / "share" / "rclpy" / "package.xml").touch()
    machine.variables.update(ROS_FROM="", ROS_DISTRO="jazzy", AMENT_PREFIX_PATH=str(own))

    assert machine.set_up("--no-build").stderr == ""
    assert machine.calls() == []


def run_with_peers(machine: Machine, *command: str) -> subprocess.CompletedProcess[str]:
    """Run tools/peers.py with a real Python, and a pip that reaches no index."""
    return subprocess.run(
        [sys.executable, str(machine.root / "tools" / "peers.py"), "--", *command],
        env={"PATH": str(machine.tools), "PIP_NO_INDEX": "1", "PIP_CONFIG_FILE": "/dev/null"},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


def test_without_the_peers_a_command_runs_and_is_told_why(machine: Machine):
    result = run_with_peers(machine, "printenv", "PEERS_MISSING")

    assert result.returncode == 0
    assert "pip could not install the packages" in result.stdout
    assert "Going on without the peers" in result.stderr


def test_the_peers_see_the_packages_of_the_environment_beside_them(machine: Machine):
    requirements = machine.root / "requirements" / "peers.txt"
    requirements.write_text(f"pytest=={pytest.__version__}\n")
    say_where = "import os, sys, pytest; print(sys.prefix, os.environ.get('PEERS_MISSING'))"

    first = run_with_peers(machine, "python", "-c", say_where)
    again = run_with_peers(machine, "python", "-c", say_where)

    assert first.stdout == again.stdout == f"{machine.root / '.venv-peers'} None\n"
    assert "Virtual environment .venv-peers" in first.stderr
    assert again.stderr == ""
