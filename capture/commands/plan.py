"""``capture-pairs plan``: what a session would do, checked, nothing moved."""

from typing import TYPE_CHECKING

from capture.commands.options import SessionOptions
from rir.command import make_console

if TYPE_CHECKING:
    from capture.config import SessionConfig

__all__ = ["show_plan"]


def show_plan(session: SessionOptions) -> None:
    """Print the plan, its length, and whether all is in reach."""
    from capture.devices.stage import build_mover
    from capture.operator.display import PlainDisplay, time_text
    from capture.session.run import check_plan

    console = make_console()
    config = session.plan()
    display = PlainDisplay(console, simulated=config.simulated)
    plan = check_plan(config, build_mover(config, operator=display))
    for number, step in enumerate(plan, start=1):
        console.out(f"{number:4d}  {step}")
    takes = sum(step.takes for step in plan.measures)
    mark = "SIMULATED" if config.simulated else "MEASURED"
    console.out(
        f"{mark} session in {config.room.name}: {len(config.pairs)} pairs, "
        f"{takes} takes of {plan.take_s:.1f} s, {len(plan.moves)} moves; "
        f"about {time_text(plan.seconds())} with a rig; every pose is in reach"
    )
    if len(config.channels.loudspeakers) > 1:
        console.out(_overlap_line(config))


def _overlap_line(config: "SessionConfig") -> str:
    """Return what overlapping the loudspeakers' sweeps saves, and what it costs."""
    from capture.operator.display import time_text
    from capture.plan import build_plan
    from capture.session.take_judge import session_sweep

    both = [config.model_copy(update={"overlap": on}) for on in (False, True)]
    one, other = (build_plan(each).seconds() for each in both)
    price = both[1].interleaving.price(session_sweep(config).rate, config.sample_rate)
    used = "on" if config.overlap else "off"
    return f"--overlap ({used}) saves {time_text(one - other)}; price: {price}"
