import numpy as np
import pytest
import torch
from numpy.testing import assert_allclose

from analysis import paper_metrics
from fields.training.metrics import paper_differences

RATE = 16000


@pytest.mark.parametrize("n_samples", [320, 1600, 4801])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 30.0])
def test_training_and_analysis_agree(n_samples, scale):
    rng = np.random.default_rng(n_samples)
    decay = scale * 10 ** (-3 * np.arange(n_samples) / (0.2 * RATE))
    truth, prediction = rng.standard_normal((2, 5, n_samples)) * decay
    expected = paper_metrics(truth, prediction, RATE)
    found = paper_differences(torch.tensor(truth), torch.tensor(prediction), RATE)
    for name, value in expected.items():
        assert_allclose(found[name].numpy(), value, rtol=1e-5, err_msg=name)


def test_a_metric_can_be_descended():
    random = torch.Generator().manual_seed(0)
    truth = torch.randn(2, 1600, generator=random)
    prediction = torch.randn(2, 1600, generator=random, requires_grad=True)
    found = paper_differences(truth, prediction, RATE)
    (found["STFT"] + found["C50"] + found["Amp"] + found["Env"]).sum().backward()
    assert prediction.grad is not None
    assert torch.isfinite(prediction.grad).all()
