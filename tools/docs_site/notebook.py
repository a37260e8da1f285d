"""The notebook of the first ten minutes: run, stored with its outputs, and shown as a page.

``python -m tools.docs_site.notebook`` runs the cells in an empty folder and stores what they
print. No Jupyter is needed: the cells are plain Python.
"""

from __future__ import annotations

import ast
import base64
import contextlib
import io
import json
import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

NOTEBOOK: Final = Path(__file__).parents[2] / "docs" / "first_ten_minutes.ipynb"
#: A fenced block of code in Markdown.
FENCED: Final = re.compile(r"(^(?:```+)[^\n]*\n.*?^```+$)", re.MULTILINE | re.DOTALL)


def run_cells(notebook: dict[str, Any], folder: Path) -> list[list[dict[str, Any]]]:
    """Run the code cells in order, in one namespace, and return the outputs of each.

    Args:
        notebook: as read from its file.
        folder: working folder of the cells.
    """
    namespace: dict[str, Any] = {"__name__": "__main__"}
    before = Path.cwd()
    os.chdir(folder)
    try:
        return [_run(source(cell), namespace) for cell in code_cells(notebook)]
    finally:
        os.chdir(before)


def code_cells(notebook: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the cells that hold code."""
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def source(cell: dict[str, Any]) -> str:
    """Return the text of a cell."""
    return "".join(cell["source"])


def printed(outputs: list[dict[str, Any]]) -> str:
    """Return the text among a cell's outputs."""
    texts = [each.get("text") or each["data"].get("text/plain", "") for each in outputs]
    return "".join("".join(text) for text in texts)


def _run(text: str, namespace: dict[str, Any]) -> list[dict[str, Any]]:
    """Run one cell; the value of a last expression is an output, as in Jupyter."""
    body = ast.parse(text)
    last = body.body.pop() if body.body and isinstance(body.body[-1], ast.Expr) else None
    stream = io.StringIO()
    value = None
    with contextlib.redirect_stdout(stream):
        exec(compile(body, "<cell>", "exec"), namespace)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), namespace)
    outputs: list[dict[str, Any]] = []
    if stream.getvalue():
        lines = stream.getvalue().splitlines(keepends=True)
        outputs.append({"name": "stdout", "output_type": "stream", "text": lines})
    if value is not None:
        outputs.append(_displayed(value))
    return outputs


def _displayed(value: Any) -> dict[str, Any]:
    """Return the output of a value: a picture where it has one, else its text."""
    picture = getattr(value, "_repr_png_", None)
    if picture is None:
        text = repr(value).splitlines(keepends=True)
        data: dict[str, Any] = {"text/plain": text}
    else:
        data = {"image/png": base64.b64encode(picture()).decode("ascii")}
    return {"output_type": "display_data", "metadata": {}, "data": data}


def page(notebook: dict[str, Any], name: str) -> tuple[str, dict[str, bytes]]:
    """Return the notebook as Markdown, and its pictures by file name.

    Args:
        notebook: as read from its file.
        name: stem of the notebook's file and of the pictures' names.
    """
    parts: list[str] = []
    pictures: dict[str, bytes] = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            parts.append(source(cell))
            continue
        parts.append(f"```python\n{source(cell)}\n```")
        for output in cell["outputs"]:
            png = output.get("data", {}).get("image/png")
            if png is not None:
                file = f"{name}_{len(pictures) + 1}.png"
                pictures[file] = base64.b64decode(png)
                parts.append(f"![{_caption(cell)}]({file})")
            elif text := printed([output]).rstrip():
                parts.append(f'```text title="Output"\n{text}\n```')
    return "\n\n".join(parts) + "\n", pictures


def _caption(cell: dict[str, Any]) -> str:
    return str(cell["metadata"].get("caption", "Output of the cell"))


def read(path: Path = NOTEBOOK) -> dict[str, Any]:
    """Return a notebook."""
    notebook: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return notebook


def main() -> int:
    """Run the notebook and store its outputs."""
    notebook = read()
    with tempfile.TemporaryDirectory() as folder:
        results = run_cells(notebook, Path(folder))
    for cell, outputs in zip(code_cells(notebook), results, strict=True):
        cell["outputs"], cell["execution_count"] = outputs, None
    text = json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"
    NOTEBOOK.write_text(text, encoding="utf-8")
    print(f"{NOTEBOOK.name}: {len(results)} cells, {len(text) / 1e3:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
