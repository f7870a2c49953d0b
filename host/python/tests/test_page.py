"""The program of the book's page about Python runs."""

import re

from conftest import ROOT


def test_the_program_of_the_page_runs(capsys):
    page = (ROOT / "docs/python.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", page, re.S)
    assert blocks, "the page has a block of Python"
    for block in blocks:
        exec(compile(block, "docs/python.md", "exec"), {})
    assert capsys.readouterr().out.startswith("0 ")
