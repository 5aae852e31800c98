"""Every field in the table keeps the same promises; no skip list."""

import pytest

from fields import FIELDS
from fields.conformance import check_field


@pytest.mark.parametrize("model", list(FIELDS))
def test_every_field_conforms(model):
    check_field(model)
