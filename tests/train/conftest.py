from tests.learning.conftest import dataset, one_thread

__all__ = ["dataset", "one_thread"]
