from tests.learning.conftest import dataset

__all__ = ["dataset"]
