"""The claims of the paper, figure by figure, and the commands that show them."""

from mcmj.experiments.reproduce.captions import TITLES
from mcmj.experiments.reproduce.claims import Claim, Command, Part
from mcmj.targets.gaits import GAITS
from mcmj.targets.limit_cycles import TARGETS

LEARNED = "drawn on the target; no error is given"
RETURNS = "returns to its orbit; no times are given"


def _of_tasks(text: str, run: str, paths: str, paper: str = LEARNED) -> tuple[Claim, ...]:
    return tuple(
        Claim(text.format(TITLES[name]), paper, run, (paths.format(name),)) for name in TARGETS
    )


FIG5 = Part(
    "fig5",
    "Fig. 5: limit cycles, one body, three readouts",
    (
        Command("limit_cycle", "limit_cycle", (), ("--free-run", "60")),
        Command(
            "success_rate", "success_rate",
            ("--engine", "twin", "--seeds", "50"), ("--engine", "twin", "--seeds", "3"),
        ),
    ),
    (
        *_of_tasks("the general body generates {}", "limit_cycle", "{}/orbit_error"),
        *_of_tasks("random bodies generate {}", "success_rate", "{}/orbit_errors/*"),
    ),
)  # fmt: skip
LONG = Part(
    "long_run",
    "Section 6.1: a million steps",
    (
        Command("long_run", "limit_cycle", ("--free-run", "1000", "--no-video"), None),
    ),
    tuple(
        Claim(
            f"no drift in 1000 s, {TITLES[name]}: the last 50 s over the second 50 s",
            "stable for 10^6 steps", "long_run", (f"{name}/windows/orbit_error_ratio",),
            kind="ratio", limit=1.1,
        )
        for name in TARGETS
    ),
)  # fmt: skip
DISTURBED = {
    "frozen_x1": "output x1 frozen",
    "frozen_x2": "output x2 frozen",
    "random_forces": "random forces on all nodes",
    "length_noise": "noise on all lengths",
}
FIG6 = Part(
    "fig6",
    "Fig. 6: disturbed for 10 s",
    (
        Command(
            "perturb", "perturb",
            ("--engine", "twin", "--seeds", "20"), ("--engine", "twin", "--seeds", "5"),
        ),
    ),
    (
        *(
            Claim(f"back after {text}", RETURNS, "perturb", (f"seeds/{name}/orbit_errors/*",))
            for name, text in DISTURBED.items()
        ),
        *(
            Claim(f"time back after {text}", RETURNS, "perturb",
                  (f"seeds/{name}/recovery_times/*",), kind="time", limit=40.0)
            for name, text in DISTURBED.items()
        ),
    ),
)  # fmt: skip
FIG7 = Part(
    "fig7",
    "Fig. 7: swinging up from total rest",
    (
        Command(
            "swing_up", "swing_up",
            ("--engine", "twin", "--seeds", "50"),
            ("--engine", "twin", "--seeds", "3", "--kicks", "0"),
        ),
    ),
    _of_tasks(
        "from rest onto {}", "swing_up", "seeds/{}/orbit_errors/*", "shown for one body"
    ),
)  # fmt: skip
GAIT_RUNS = (
    Command("gaits", "gaits", (), ("--engine", "twin")),
    Command("gait_seeds", "gaits", ("--engine", "twin", "--seeds", "20"), None),
)
FIG8 = Part(
    "fig8",
    "Figs. 8 and 9: four gaits by one body, switched by its readout",
    GAIT_RUNS,
    (
        *(
            Claim(f"the body's {name}", LEARNED, "gaits", (f"{name}/orbit_error",))
            for name in GAITS
        ),
        Claim("all 12 switches end in the new gait", "shown for three from walk", "gaits",
              ("switch/*/orbit_error",), needed=1.0),
        Claim("time of a switch", "a few periods", "gaits", ("switch/*/switching_time",),
              kind="time", limit=80.0, needed=1.0),
        Claim("random bodies: worst of the four gaits", LEARNED, "gait_seeds",
              ("seeds/outcomes/*/worst_orbit_error",)),
        Claim("random bodies: worst of the 12 switches", "not given", "gait_seeds",
              ("seeds/outcomes/*/worst_switch_error",)),
    ),
)  # fmt: skip
FIG10 = Part(
    "fig10",
    "Figs. 10 and 11: the input chooses the rhythm",
    (
        Command(
            "input_driven", "input_driven",
            ("--body", "input_driven"),
            ("--body", "input_driven", "--engine", "twin", "--sweep", "0"),
        ),
        Command("input_seeds", "input_driven", ("--engine", "twin", "--seeds", "20"), None),
    ),
    (
        *(
            Claim(f"eps = {eps}", LEARNED, "input_driven", (f"eps/{eps}/orbit_error",))
            for eps in ("5", "1", "0.2")
        ),
        *(
            Claim(f"random bodies, eps = {eps}", "not given", "input_seeds",
                  (f"rates/{eps}/orbit_errors/*",))
            for eps in ("5", "1", "0.2")
        ),
    ),
)  # fmt: skip
ACCURACY = Part(
    "speed_accuracy",
    "Speed against error: what the physics is worth",
    (
        Command("speed_accuracy", "speed_accuracy", (), None, alone=True),
        Command("certify", "certify", (), None),
    ),
    (
        Claim("the cycle is stable: leading nontrivial Floquet multiplier", "not given", "certify",
              ("leading_nontrivial",), kind="ratio", limit=0.999),
    ),
)  # fmt: skip
PARTS = (FIG5, LONG, FIG6, FIG7, FIG8, FIG10, ACCURACY)
