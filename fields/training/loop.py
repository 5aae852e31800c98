"""The training loop of every neural field."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from fields.data import FieldData
from fields.layers.query import Query
from fields.plan import Progress, TrainingPlan
from fields.training.checkpoint import read_checkpoint, write_checkpoint
from fields.training.guards import Guards
from fields.training.network import Levelled, NetworkField
from fields.training.ranks import Ranks
from fields.training.schedule import batch_rows, cosine, step_random
from rir.errors import TrainingError

__all__ = ["Trainer", "fit_network"]

HISTORY_POINTS = 200
"""Losses kept for plots: a point in every second pixel, whatever the steps."""
WATCHED_AT = (0.05, 0.1, 0.2, 0.35, 0.5, 0.75)
"""Parts of the training after which it is scored: denser where it learns fast."""

Term = Callable[[Any, Query, Tensor, float, torch.Generator], Tensor]


def fit_network(
    network_type: Callable[..., nn.Module],
    data: FieldData,
    config: Any,
    plan: TrainingPlan,
    term: Term | None = None,
) -> NetworkField:
    """Train a network from its seed and answer the field.

    Parameters
    ----------
    network_type : callable
        Builds the network from a frame and a configuration.
    data : FieldData
        Rows to learn from.
    config : Any
        The model's configuration.
    plan : TrainingPlan
        How to train.
    term : callable, optional
        A further loss beside the network's own.

    Raises
    ------
    TrainingError
        If the plan asks for self-supervision and the model gives no term.
    """
    if plan.self_supervised != "none" and term is None:
        raise TrainingError(
            "self-supervision exchanges the listener's pattern, which this model "
            "cannot; choose avr, or --exchange"
        )
    device = _device(plan.device)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(plan.seed)
        network: Any = network_type(data.frame, config)
    network.observe(data)
    network.to(device)
    trainer = Trainer(network, data, plan, term)
    report = trainer.run()
    if isinstance(network, Levelled):
        trainer.network.eval()
        network.fit_level(data)
    return NetworkField(network, config, data.frame, report)


@dataclass
class _State:
    step: int = 0
    seconds: float = 0.0
    guards: Guards = field(default_factory=Guards)
    history: list[tuple[int, float, float]] = field(default_factory=list)
    curve: list[dict[str, float]] = field(default_factory=list)
    watched: int = 0


class Trainer:
    """Run AdamW with a cosine over a network, guarded, timed and resumable.

    Parameters
    ----------
    network : nn.Module
        The network, on its device.
    data : FieldData
        Rows to learn from.
    plan : TrainingPlan
        How to train.
    term : callable, optional
        A further loss: (network, query, target, fraction, random) to a scalar.
    clock : callable, optional
        Seconds for the budget; CPU seconds of the process by default, wall
        seconds on CUDA.
    """

    def __init__(
        self,
        network: Any,
        data: FieldData,
        plan: TrainingPlan,
        term: Term | None = None,
        clock: Callable[[], float] | None = None,
    ) -> None:
        self.network = network
        self.data = data
        self.plan = plan
        self.term = term
        self.device = next(network.parameters()).device
        on_cuda = self.device.type == "cuda"
        self.clock = clock or (time.perf_counter if on_cuda else time.process_time)
        self.ranks = Ranks(plan.device)
        self.state = _State()
        self.steps = self._planned_steps()
        self.queries = Query.of(data.emitters, data.listeners, self.device)
        self.optimizer = torch.optim.AdamW(
            network.parameters(), lr=plan.learning_rate, weight_decay=plan.weight_decay
        )
        self.loss_of = torch.compile(self._loss) if plan.compile else self._loss

    def run(self) -> dict[str, Any]:
        """Train to the end of the steps or the budget and answer the report."""
        self.ranks.share_weights(self.network)
        if self.plan.resume and self.plan.out is not None:
            self._restore()
        started, before = self.clock(), self.state.seconds
        saved = self.state.seconds
        self.network.train()
        while (fraction := self._fraction()) < 1.0:
            loss = self._step(fraction)
            self.state.step += 1
            self.state.seconds = before + self.clock() - started
            self._tell(loss, fraction)
            # What watching costs is no training.
            started += self._watch(loss, fraction)
            if self.state.seconds - saved > self.plan.checkpoint_s:
                saved = self.state.seconds
                self._save()
        self._save()
        return self._report()

    def _planned_steps(self) -> int:
        if self.plan.epochs is None:
            return self.plan.steps
        size = (self.plan.batch_size or self.network.batch_size) * self.ranks.count
        return max(round(self.plan.epochs * len(self.data) / size), 1)

    def _fraction(self) -> float:
        done = self.state.step / max(self.steps, 1)
        if self.plan.budget_s is not None:
            done = max(done, self.state.seconds / max(self.plan.budget_s, 1e-9))
        return self.ranks.largest(done)

    def _step(self, fraction: float) -> float:
        plan, step = self.plan, self.state.step
        rate = cosine(plan.learning_rate, plan.final_learning_rate, fraction)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        random = step_random(plan.seed, step, self.ranks.rank)
        query, target = self._batch(step, random)
        self.optimizer.zero_grad(set_to_none=True)
        loss = self.loss_of(query, target, fraction, random)
        accepted = self.state.guards.accept_loss(loss)
        if accepted:
            loss.backward()
        self.ranks.mean_gradients(self.network)
        if accepted or self.ranks.count > 1:
            self.state.guards.mend(self.network.parameters(), plan.gradient_clip)
            self.optimizer.step()
        return float(loss.detach())

    def _loss(
        self, query: Query, target: Tensor, fraction: float, random: torch.Generator
    ) -> Tensor:
        half = self.plan.precision == "bfloat16"
        with torch.autocast(self.device.type, torch.bfloat16, enabled=half):
            loss = self.network.training_loss(query, target, random)
            if self.term is not None:
                loss = loss + self.term(self.network, query, target, fraction, random)
        return loss

    def _batch(self, step: int, random: torch.Generator) -> tuple[Query, Tensor]:
        size = (self.plan.batch_size or self.network.batch_size) * self.ranks.count
        rows = batch_rows(len(self.data), size, self.plan.seed, step)
        rows = rows[self.ranks.rank :: self.ranks.count]
        if self.plan.exchange == "double":
            rows = rows[: max(1, len(rows) // 2)]
        query = self.queries[rows.to(self.device)]
        target = self._targets(rows)
        if self.plan.exchange == "double":
            both = query.joined(query.swapped(self.plan.exchange_mode))
            return both, torch.cat([target, target])
        if self.plan.exchange == "flip":
            coins = torch.rand(len(rows), generator=random) < 0.5
            query = query.swapped_where(coins.to(self.device), self.plan.exchange_mode)
        return query, target

    def _targets(self, rows: Tensor) -> Tensor:
        # Sorted reads are what a memory map and HDF5 are good at.
        order = np.sort(rows.numpy())
        found = np.asarray(self.data.responses[order], dtype=np.float32)
        places = np.searchsorted(order, rows.numpy())
        return torch.from_numpy(np.ascontiguousarray(found[places])).to(self.device)

    def _tell(self, loss: float, fraction: float) -> None:
        state = self.state
        if len(state.history) <= fraction * HISTORY_POINTS:
            state.history.append((state.step, state.seconds, loss))
        if self.plan.on_progress is not None and self.ranks.first:
            self.plan.on_progress(Progress(state.step, fraction, loss, state.seconds))

    def _watch(self, loss: float, fraction: float) -> float:
        """Score the field when a mark is passed; returns the seconds it took."""
        passed = sum(fraction >= mark for mark in WATCHED_AT)
        watch = self.plan.watch
        if watch is None or not self.ranks.first or passed <= self.state.watched:
            return 0.0
        started, state = self.clock(), self.state
        state.watched = passed
        scores = watch(NetworkField(self.network, None, self.data.frame, {}))
        self.network.train()
        state.curve.append({"step": state.step, "seconds": state.seconds, **scores})
        if self.plan.on_progress is not None:
            now = Progress(state.step, fraction, loss, state.seconds, scores)
            self.plan.on_progress(now)
        return self.clock() - started

    def _save(self) -> None:
        if self.plan.out is None or not self.ranks.first:
            return
        state = self.state
        write_checkpoint(
            self.plan.out,
            {
                "network": self.network.state_dict(),
                "optimizer": self.optimizer.state_dict(),
                "step": state.step,
                "seconds": state.seconds,
                "guards": state.guards.as_dict(),
                "history": state.history,
                "curve": state.curve,
                "watched": state.watched,
            },
        )

    def _restore(self) -> None:
        stored = read_checkpoint(self.plan.out) if self.plan.out else None
        if stored is None:
            return
        try:
            self.network.load_state_dict(stored["network"])
        except RuntimeError as error:
            raise TrainingError(
                f"the checkpoint in {self.plan.out} belongs to another model or "
                "another size; choose another --out or leave out --resume"
            ) from error
        self.optimizer.load_state_dict(stored["optimizer"])
        self.state = _State(
            stored["step"],
            stored["seconds"],
            Guards(**stored["guards"]),
            [tuple(point) for point in stored["history"]],
            stored.get("curve", []),
            stored.get("watched", 0),
        )

    def _report(self) -> dict[str, Any]:
        state = self.state
        return {
            "steps": state.step,
            "seconds": round(state.seconds, 3),
            "history": [list(point) for point in state.history],
            "curve": state.curve,
            **state.guards.as_dict(),
        }


def _device(name: str) -> torch.device:
    if name == "cuda" and not torch.cuda.is_available():
        raise TrainingError(
            "device cuda is asked for, but this torch sees no CUDA device; "
            "use --device cpu"
        )
    if name not in ("cpu", "cuda"):
        raise TrainingError(f"no device {name!r}; known: cpu, cuda")
    return torch.device(name)
