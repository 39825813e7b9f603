"""Training steps recorded as CUDA graphs.

A GPU is done with a step of a small network long before a CPU has started each of its hundreds of kernels. A
graph starts them all at once (https://docs.pytorch.org/docs/stable/notes/cuda.html#cuda-graphs).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import torch
from torch import Tensor, nn

_WARM_UPS = 3
"""Steps before the recording, in which libraries choose their algorithms and allocate."""


class _Recorded(NamedTuple):
    """A graph with its input and output, which stay where they are."""

    graph: torch.cuda.CUDAGraph
    rows: Tensor
    loss: Tensor


class GraphedStep:
    """A training step that is recorded once for each size of batch, and replayed from then on."""

    def __init__(
        self,
        step: Callable[[Tensor], Tensor],
        network: nn.Module,
        optimiser: torch.optim.Optimizer,
        generator: torch.Generator,
    ):
        """Record nothing yet.

        Args:
            step: Changes the weights by what it learns from some rows (n,), without waiting for the GPU, and
                returns its loss.
            network: Network that the step changes, on the GPU.
            optimiser: Made with ``capturable=True``.
            generator: On the GPU, from which the step draws, besides the default generator.
        """
        self._step, self._network, self._optimiser, self._generator = step, network, optimiser, generator
        self._recorded: dict[int, _Recorded] = {}

    def __call__(self, rows: Tensor) -> Tensor:
        """Learn from some rows (n,); the next step on a batch of this size overwrites the loss."""
        known = self._recorded.get(len(rows))
        if known is None:
            known = self._recorded[len(rows)] = self._record(rows)
        known.rows.copy_(rows)
        known.graph.replay()
        return known.loss

    def _record(self, rows: Tensor) -> _Recorded:
        device = next(self._network.parameters()).device
        rows = rows.to(device, copy=True)
        fresh = not self._optimiser.state
        before = [(values, values.detach().clone()) for values in self._changed()]
        generators = (self._generator, torch.cuda.default_generators[device.index])
        drawn = [generator.get_state() for generator in generators]
        here, aside = torch.cuda.current_stream(device), torch.cuda.Stream(device)
        aside.wait_stream(here)
        with torch.cuda.stream(aside):
            for _ in range(_WARM_UPS):
                self._step(rows)
        here.wait_stream(aside)
        # In place, where the graph will find them: nothing was learned yet.
        with torch.no_grad():
            for values, old in before:
                values.copy_(old)
            if fresh:  # an optimiser's state begins with zeros
                for state in self._optimiser.state.values():
                    for values in state.values():
                        values.zero_()
        for generator, state in zip(generators, drawn, strict=True):
            generator.set_state(state)
        graph = torch.cuda.CUDAGraph()
        graph.register_generator_state(self._generator)
        with torch.cuda.graph(graph):
            loss = self._step(rows)
        return _Recorded(graph, rows, loss)

    def _changed(self) -> Iterator[Tensor]:
        """Everything that a step changes."""
        yield from self._network.parameters()
        yield from self._network.buffers()
        for state in self._optimiser.state.values():
            yield from state.values()
