"""What the pictures and films of the page show."""

from mcmj.targets.limit_cycles import TARGETS
from mcmj.targets.named import NAMES

TITLES = {
    "van_der_pol": "Van der Pol",
    "quadratic": "the quadratic limit cycle",
    "lissajous": "Lissajous 3:2",
}
FREE = "The first and the last part of each free run, the phase plane, and the body"
OF_RUNS = {
    ("limit_cycle", "limit_cycle"): f"{FREE}: one body, three readouts (Fig. 5).",
    ("success_rate", "limit_cycle"): f"{FREE}: the first of the random bodies.",
    ("success_rate", "success_rate"): "Orbit errors of the random bodies, sorted, a curve a task; "
    "those above the line fail.",
    ("long_run", "limit_cycle"): "Free runs of 1000 s: the first and the last part.",
    ("perturb", "perturb"): "The outputs before, while and after the first body is disturbed, and "
    "the phase plane in the same colours (Fig. 6).",
    ("perturb", "noise_tolerance"): "Orbit error after some time of noise on the lengths, against "
    "its amplitude; a line a body.",
    ("swing_up", "swing_up"): "The first body, from total rest onto the orbits (Fig. 7).",
    ("gaits", "gaits"): "The four outputs around each switch from the first gait, on the targets "
    "before and after (Fig. 9).",
    ("gaits", "gait_diagram"): "When each leg stands: in the gaits, beside their targets, and "
    "around the switches (Fig. 8).",
    ("gait_seeds", "gaits"): "The first of the random bodies: its outputs around each switch.",
    ("gait_seeds", "gait_diagram"): "The first of the random bodies: when each leg stands.",
    ("input_driven", "input_curves"): "Amplitude and frequency against the input (Fig. 10).",
    ("input_driven", "input_jumps"): "After a jump to each input: the last part on its target, and "
    "the phase plane (Fig. 11).",
    ("input_seeds", "input_curves"): "The first of the random bodies: amplitude and frequency "
    "against the input.",
    ("input_seeds", "input_jumps"): "The first of the random bodies, after a jump to each input.",
    ("speed_accuracy", "speed_accuracy"): "Error against cost: a panel a body, a curve a method, a "
    "point a step.",
    ("certify", "certificate"): "Orbit, multipliers, starts, blows and tolerances of one body.",
}


def caption(run: str, stem: str) -> str:
    """Of a file of a run, given without its suffix."""
    if stem in TARGETS:
        return f"The body in its free run: {TITLES[stem]}."
    if stem in NAMES:
        return f"The body in its free run: {stem}."
    return OF_RUNS.get((run, stem), f"{run}: {stem}.".replace("_", " ").capitalize())
