"""Look for a rig that lies or collides, in random sequences of calls and faults.

Bar: no rule broken in 10,000 sequences.
"""

import sys
import time
from collections import Counter
from collections.abc import Sequence

from harness import make_parser, write_results
from rig_ordeal import BrokenRuleError, run_sequence


def main(argv: Sequence[str] | None = None) -> int:
    parser = make_parser(__doc__, "rig_faults")
    parser.add_argument("--sequences", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--lost-steps", action="store_true")
    options = parser.parse_args(argv)
    count = 30 if options.quick else options.sequences
    began = time.process_time()
    broken: dict[int, str] = {}
    errors: Counter[str] = Counter()
    longest = 0.0
    for seed in range(options.first, options.first + count):
        try:
            ordeal = run_sequence(seed, lost_steps=options.lost_steps)
        except BrokenRuleError as error:
            broken[seed] = str(error)
            print(f"seed {seed}: {error}", flush=True)
            continue
        if (seed + 1) % 500 == 0:
            print(f"{seed + 1}: {len(broken)} broken", flush=True)
        errors.update(text.partition(":")[0] for text in ordeal.errors)
        longest = max(longest, ordeal.longest)
    seconds = time.process_time() - began
    print(f"{count} sequences, {len(broken)} broke a rule, {seconds:.0f} CPU s")
    print(f"longest call {longest:.0f} simulated s")
    for name, number in errors.most_common():
        print(f"  {name:<22} {number}")
    report = {
        "sequences": count,
        "lost_steps": options.lost_steps,
        "first_seed": options.first,
        "broken": broken,
        "errors": dict(errors),
        "longest_call_s": longest,
        "cpu_s": seconds,
    }
    write_results(options.out, report)
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
