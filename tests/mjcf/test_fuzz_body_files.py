"""Mutated body files: no crash, no hang, nothing but our errors."""

import pytest
from fuzz_body_files import BATCH, run_batch


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(0, 2000, BATCH))
def test_mutated_body_files_cannot_harm(seed):
    run_batch(seed)
