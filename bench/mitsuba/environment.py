"""A virtual environment with Mitsuba, an LLVM for it, and the `rtsl` to compare."""

import ctypes.util
import os
import subprocess
import sys
import venv
from glob import glob
from pathlib import Path

PACKAGES = "mitsuba>=3.6", "numpy"
REPOSITORY = Path(__file__).resolve().parents[2]


def stop(message: str):
    sys.exit(f"compare.py: {message}")


def enter(folder: Path) -> None:
    """Starts this program again in the environment, which is made where there is none."""
    if Path(sys.prefix).resolve() == folder.resolve():
        return
    python = folder / "bin" / "python"
    if not has_packages(python):
        print(f"installing {', '.join(PACKAGES)} into {folder}", flush=True)
        venv.create(folder, with_pip=True)
        pip = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES]
        if subprocess.run(pip).returncode != 0:
            stop(f"pip could not install {', '.join(PACKAGES)}")
    sys.stdout.flush()
    os.execv(python, [python, *sys.argv])


def has_packages(python: Path) -> bool:
    imports = [python, "-c", "import mitsuba, numpy"]
    return python.exists() and subprocess.run(imports, capture_output=True).returncode == 0


def find_llvm() -> None:
    """Sets where Mitsuba's compiler finds LLVM, unless it is set."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    patterns = "/usr/lib/llvm-*/lib/libLLVM.so*", "/usr/lib/*/libLLVM*.so*", "/usr/lib64/libLLVM*.so*"
    libraries = [path for pattern in patterns for path in glob(pattern)]
    if libraries:
        os.environ["DRJIT_LIBLLVM_PATH"] = max(libraries, key=llvm_version)
    elif not ctypes.util.find_library("LLVM"):
        stop("Mitsuba needs LLVM: install libllvm19, or name it in DRJIT_LIBLLVM_PATH")


def llvm_version(path: str) -> int:
    digits = "".join(letter if letter.isdigit() else " " for letter in path.replace("x86_64", ""))
    return max((int(number) for number in digits.split()), default=0)


def rtsl_program(given: Path | None) -> Path:
    if given:
        return given.resolve() if given.is_file() else stop(f"there is no `{given}`")
    command = ["cargo", "build", "--release", "--package", "rtsl-cli"]
    print(" ".join(command), flush=True)
    if subprocess.run(command, cwd=REPOSITORY).returncode != 0:
        stop("rtsl could not be built; --rtsl names one")
    target = os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")
    return Path(target) / "release" / "rtsl"
