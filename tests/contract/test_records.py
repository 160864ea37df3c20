"""Compiled records are declared once, and the type checker sees into the kernels that use them."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt
import pytest

from drumstick.parameters.declare import quantities
from drumstick.parameters.stick import Stick
from drumstick.stick.effects.registry import EFFECTS
from drumstick.stick.records import Law, field_of
from realtime.records import Float32, Record, dtype_of, fields_of

ROOT = Path(__file__).resolve().parents[2]
CONTACT = ROOT / "shared" / "drumstick" / "stick" / "composition.py"


@pytest.mark.parametrize("name", ["stick", *EFFECTS])
def test_a_laws_record_has_the_fields_of_its_table_and_no_other(name: str) -> None:
    table, record = (Stick, Law) if name == "stick" else (EFFECTS[name].TABLE, EFFECTS[name].LAW)
    expected = {
        field_of(key, quantity): "f8" if quantity.kind is float else "i8"
        for key, quantity in quantities(table).items()
    }
    assert {field: kind for field, kind, *_ in fields_of(record)} == expected


class Inner(Record):
    """A record inside another."""

    n: int


class Whole(Inner):
    """With what it has from its base class first."""

    x: float
    small: Float32
    inner: Inner
    many: Annotated[npt.NDArray[np.float64], "f8", (3,)]


def test_numpys_type_is_made_of_the_annotations() -> None:
    assert dtype_of(Whole) == np.dtype(
        [("n", "i8"), ("x", "f8"), ("small", "f4"), ("inner", [("n", "i8")]), ("many", "f8", (3,))],
        align=True,
    )


class Wordy(Record):
    """A record cannot hold text."""

    name: str


def test_a_field_that_no_record_can_have_is_refused() -> None:
    with pytest.raises(TypeError, match="no field of the type <class 'str'>"):
        dtype_of(Wordy)


def _errors(tree: Path, file: Path) -> list[str]:
    # What the strict checker says of one file of a copy of the product.
    settings = {"include": [str(file.relative_to(tree))], "extraPaths": ["."], "pythonVersion": "3.11"}
    project = tree / "pyrightconfig.json"
    project.write_text(json.dumps(settings), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(project)],
        capture_output=True, text=True, check=False, cwd=tree, timeout=300,
    )  # fmt: skip
    return [found["message"] for found in json.loads(done.stdout)["generalDiagnostics"]]


def test_a_misspelt_field_in_the_contact_law_is_an_error_of_the_type_checker(tmp_path: Path) -> None:
    tree = tmp_path / "shared"
    shutil.copytree(ROOT / "shared", tree, ignore=shutil.ignore_patterns("__pycache__"))
    contact = tree / CONTACT.relative_to(ROOT / "shared")
    assert _errors(tree, contact) == []
    text = contact.read_text(encoding="utf-8")
    assert text.count("law.k_coll ") == 1
    contact.write_text(text.replace("law.k_coll ", "law.k_col "), encoding="utf-8")
    assert any('attribute "k_col" for class "Law"' in error for error in _errors(tree, contact))
