"""Writes the API reference from the docstrings, as HTML: python reference.py FOLDER

The compiled half says what things do and how they are made, its stub of what types they are; here they meet.
"""

import inspect
import sys
from functools import cached_property
from pathlib import Path

import pdoc
import pdoc.doc
import pdoc.doc_pyi
import pdoc.render

import frameless
from frameless import _frameless


def stub_of(module: str) -> Path | None:
    """The compiled half's classes are shown as the package's."""
    return find_stub("frameless._frameless" if module == "frameless" else module)


def explained(shown: pdoc.doc.Class) -> str:
    """What is said of a class; of a compiled one how it is made, too, which pdoc does not see."""
    said = inspect.cleandoc(shown.obj.__doc__ or "")
    # The stub's class of that name knows what it says, but not how it is made.
    compiled = getattr(_frameless, shown.name, shown.obj)
    if getattr(compiled, "__text_signature__", None) is None:
        return said
    return f"`{shown.name}{inspect.signature(compiled)}`\n\n{said}"


find_stub = pdoc.doc_pyi.find_stub_file
docstring = cached_property(explained)
docstring.__set_name__(pdoc.doc.Class, "docstring")
setattr(pdoc.doc.Class, "docstring", docstring)
setattr(pdoc.doc_pyi, "find_stub_file", stub_of)
pdoc.render.configure(docformat="markdown", show_source=False)
pdoc.pdoc(frameless.__name__, "!frameless._frameless", "!frameless.bench", output_directory=Path(sys.argv[1]))
