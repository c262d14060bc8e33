"""Keeps the stub's docstrings those of the compiled half, for editors, which read the stub only.

python stub_docs.py            writes them into frameless/_frameless.pyi
python stub_docs.py --check    fails if that would change it
"""

import ast
import inspect
import sys
from pathlib import Path

from frameless import _frameless

STUB = Path(__file__).resolve().parents[1] / "frameless/_frameless.pyi"


def is_text(node: ast.AST | None) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def without_docstrings(source: str) -> list[str]:
    """The stub's lines, with ``...`` where a function had nothing but its docstring."""
    lines = source.splitlines()
    texts = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Expr) and is_text(node)]
    for node in sorted(texts, key=lambda node: -node.lineno):
        assert node.end_lineno is not None
        del lines[node.lineno - 1 : node.end_lineno]
        head = lines[node.lineno - 2]
        if head.lstrip().startswith(("def ", ")")) and head.endswith(":"):
            lines[node.lineno - 2] = head + " ..."
    return lines


def documented(source: str) -> str:
    """The stub with every docstring that the compiled half has."""
    lines = without_docstrings(source)
    # From the end, so that the numbers of the lines before stay right.
    for node in reversed(ast.parse("\n".join(lines)).body):
        thing = getattr(_frameless, getattr(node, "name", ""), None)
        if isinstance(node, ast.FunctionDef):
            explain(lines, node, thing)
        elif isinstance(node, ast.ClassDef) and thing is not None:
            for inner in reversed(node.body):
                target = inner.target if isinstance(inner, ast.AnnAssign) else None
                name = target.id if isinstance(target, ast.Name) else getattr(inner, "name", "__")
                if not name.startswith("__"):
                    explain(lines, inner, getattr(thing, name))
            lines[node.lineno:node.lineno] = quoted(inspect.getdoc(thing), 4)
    return "\n".join(lines) + "\n"


def explain(lines: list[str], node: ast.stmt, thing: object) -> None:
    """Writes what is said of a function or an attribute below its head."""
    said = quoted(inspect.getdoc(thing), node.col_offset + (4 if isinstance(node, ast.FunctionDef) else 0))
    if said:
        assert node.end_lineno is not None
        lines[node.end_lineno - 1] = lines[node.end_lineno - 1].removesuffix(" ...")
        lines[node.end_lineno : node.end_lineno] = said


def quoted(said: str | None, indent: int) -> list[str]:
    """As the lines of a docstring."""
    if not said:
        return []
    margin, text = " " * indent, said.replace("\\", "\\\\").split("\n")
    if len(text) == 1:
        return [f'{margin}"""{text[0]}"""']
    return [f'{margin}"""{text[0]}', *(f"{margin}{line}".rstrip() for line in text[1:]), f'{margin}"""']


def main() -> None:
    before = STUB.read_text(encoding="utf-8")
    head, line, rest = before.partition("\n")
    after = head + line + documented(rest)
    if "--check" not in sys.argv:
        STUB.write_text(after, encoding="utf-8")
    elif before != after:
        sys.exit(f"{STUB.name} has not the docstrings of the compiled half: run python docs/stub_docs.py")


if __name__ == "__main__":
    main()
