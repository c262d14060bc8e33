"""Executes a notebook and keeps what it shows: the notebook with its outputs, and its pictures as files.

Run it: python execute_notebook.py figures.ipynb --out FOLDER
"""

import argparse
import base64
from pathlib import Path

import nbformat
from nbclient import NotebookClient


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("notebook", type=Path)
    arguments.add_argument("--out", type=Path, required=True)
    given = arguments.parse_args()
    notebook = nbformat.read(given.notebook, as_version=4)
    # What a cell raises is raised here.
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(given.notebook.parent)}}).execute()
    given.out.mkdir(parents=True, exist_ok=True)
    pictures = 0
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            data = output.get("data", {})
            if "image/png" in data:
                pictures += 1
                (given.out / f"figure-{pictures}.png").write_bytes(base64.b64decode(data["image/png"]))
    nbformat.write(notebook, given.out / given.notebook.name)
    frames = sum("<iframe" in str(output) for cell in notebook.cells for output in cell.get("outputs", []))
    if pictures < 2 or frames < 1:
        raise SystemExit(f"wanted at least 2 pictures and a page inline, got {pictures} and {frames}")
    print(f"{pictures} pictures, {frames} page inline -> {given.out}")


if __name__ == "__main__":
    main()
