"""The blocks of docs/python.md run, one after the other, as they stand there."""

import os
import re

import pytest

from conftest import ROOT


def test_every_block_of_the_page_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 6
    monkeypatch.chdir(ROOT)
    names: "dict[str, object]" = {}
    for number, block in enumerate(blocks, 1):
        exec(compile(block, f"docs/python.md, block {number}", "exec"), names)
    assert not os.path.exists("generator.toml")


def test_the_page_names_every_example() -> None:
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    for example in (ROOT / "python" / "examples").iterdir():
        assert example.name.startswith(("__", ".")) or f"`{example.name}`" in text, example.name
