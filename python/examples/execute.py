"""Executes the notebooks of this folder, and writes what they print and show into them.

    python examples/execute.py [--check] [NAME...]

With `--check` nothing is written.
"""

from __future__ import annotations

import argparse
import pathlib
import time
from concurrent.futures import ThreadPoolExecutor

import nbformat
from nbclient import NotebookClient

FOLDER = pathlib.Path(__file__).parent


def execute(path: pathlib.Path, is_checked: bool) -> None:
    """Executes a notebook. Raises CellExecutionError if a cell does."""
    notebook = nbformat.read(path, as_version=4)
    start = time.monotonic()
    resources = {"metadata": {"path": str(FOLDER)}}
    NotebookClient(notebook, timeout=120, kernel_name="python3", resources=resources).execute()
    for cell in notebook.cells:
        # Times of execution, and widgets, which show nothing without a kernel.
        cell.metadata.pop("execution", None)
    notebook.metadata.pop("widgets", None)
    notebook.metadata["language_info"] = {"name": "python"}
    if not is_checked:
        nbformat.write(notebook, path)
    print(f"{path.name}: {time.monotonic() - start:.1f} s")


def main() -> None:
    parser = argparse.ArgumentParser(description="Executes the notebooks of this folder.")
    parser.add_argument("names", nargs="*", help="the notebooks, without their ending; all if none is given")
    parser.add_argument("--check", action="store_true", help="write nothing")
    options = parser.parse_args()
    names = options.names or sorted(path.stem for path in FOLDER.glob("*.ipynb"))
    with ThreadPoolExecutor(max_workers=2) as threads:
        list(threads.map(lambda name: execute(FOLDER / f"{name}.ipynb", options.check), names))


if __name__ == "__main__":
    main()
