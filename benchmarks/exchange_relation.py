"""Does exchange pay where the paper says so: train vanilla and exchanged, compare."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from fields.compare import CompareConfig, compare
from fields.results import ResultTable
from rir.config import load_yaml

CONFIG = Path(__file__).with_name("configs") / "exchange.yaml"


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--config", type=Path, default=CONFIG)
    parser.add_argument("--out", type=Path, default=Path("results/exchange_relation"))
    options = parser.parse_args(argv)
    config = load_yaml(options.config, CompareConfig)
    if options.quick:
        config = _small(config)
    for table in compare(config, options.out, print):
        _show(table)
    return 0


def _small(config: CompareConfig) -> CompareConfig:
    """Keep the code path, not the figures."""
    sets = tuple(
        one.model_copy(update={"scene": "kitchen", "listeners": 4, "test_rows": 8})
        for one in config.sets
    )
    models = tuple(
        one.model_copy(update={"budget_s": 0.1}) for one in config.models[:2]
    )
    return config.model_copy(
        update={"sets": sets, "models": models, "seeds": (0,), "budget_s": 0.1}
    )


def _show(table: ResultTable) -> None:
    rows = {row["method"]: row for row in table.rows}
    print(f"{table.title} [{table.mark}]: change by exchange, per cent")
    for method, row in rows.items():
        partner = rows.get(method.replace(" vanilla", " exchange"))
        if partner is None or partner is row:
            continue
        gains = ", ".join(
            f"{name} {100 * (partner[name] / row[name] - 1):+.0f}"
            for name in ("C50", "STFT", "STFT*", "Amp", "EDT", "swap C50")
        )
        print(f"  {method.removesuffix(' vanilla'):12s} {gains}")


if __name__ == "__main__":
    raise SystemExit(main())
