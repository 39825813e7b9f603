import subprocess
import sys

import pytest

import mskgrasp
from mskgrasp import learning, train


@pytest.mark.parametrize("package", [mskgrasp, learning, train], ids=lambda package: package.__name__)
def test_every_public_name_resolves_and_is_documented(package):
    for name in package.__all__:
        value = getattr(package, name)
        assert (value.__doc__ or "").strip(), name
    assert sorted(package.__all__) == list(package.__all__), "keep __all__ sorted"


def test_importing_the_package_loads_neither_torch_nor_a_simulator_and_changes_no_signal():
    code = (
        "import signal, sys; before = signal.getsignal(signal.SIGINT)\n"
        "import mskgrasp, mskgrasp.learning, mskgrasp.train\n"
        "assert not {'torch', 'sapien', 'mani_skill', 'hal'} & set(sys.modules), sorted(sys.modules)\n"
        "assert signal.getsignal(signal.SIGINT) is before\n"
        "assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_name_that_does_not_exist_is_an_attribute_error():
    assert not hasattr(mskgrasp, "Grsap")
    assert "Grasp" in dir(mskgrasp)
