import subprocess
import sys
from pathlib import Path

import pytest

from fields import FIELDS, load_field
from fields.table import model_config
from rir.errors import ConfigError, TrainingError, UnknownNameError

MODELS = Path(__file__).parents[2] / "fields" / "models"


def python(code):
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )


def test_importing_fields_does_not_import_torch():
    code = (
        "import sys, fields, fields.cli; fields.FIELDS; fields.train; "
        "print('torch' in sys.modules)"
    )
    assert python(code).stdout.strip() == "False"


def test_baselines_train_without_torch(tmp_path):
    code = f"""
import sys
sys.modules["torch"] = None
import numpy as np
from fields import load_field, train
from rir import Dataset
from rir.errors import MissingPartError
data = Dataset.from_arrays(
    np.ones((2, 3, 8)), np.eye(2, 3), np.eye(3), sample_rate=8000
)
for name in ("nearest", "linear"):
    path = train(data, model=name).save({str(tmp_path)!r} + "/" + name)
    print(load_field(path).predict(np.zeros(3), np.ones(3)).shape)
try:
    train(data, model="inras")
except MissingPartError as error:
    print(str(error).count("\\n"), "resounding[fields]" in str(error))
"""
    result = python(code)
    assert result.stdout.split("\n")[:3] == ["(1, 8)", "(1, 8)", "0 True"], result


def test_every_model_file_is_in_the_table_and_back():
    files = {path.stem for path in MODELS.glob("*.py")} - {"__init__"}
    listed = {kind.module.rsplit(".", 1)[1] for kind in FIELDS.values()}
    assert files == listed


def test_unknown_model_names_the_near_one():
    with pytest.raises(UnknownNameError, match="did you mean 'nearest'"):
        FIELDS["nearst"]


def test_unknown_setting_names_the_near_one():
    with pytest.raises(ConfigError, match="did you mean 'neighbours'"):
        model_config("linear", {"neighbors": 3})


def test_missing_field_is_one_clear_error(tmp_path):
    with pytest.raises(TrainingError, match="no field at"):
        load_field(tmp_path)
