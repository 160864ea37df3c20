"""Mutants that no test could tell from the program, each marked by hand with the reason: they do not count."""

from drumstick_lab.benchmarks.mutants.mutation_mutants import Mutant

_CAMERA = "any camera will do: viser only has to know one"
_MESSAGES = "services/web_panel/access/client_message.py"
_PANEL = "services/web_panel/access/viser_access.py"
_FENCE = "shared/drumstick/safety/fence.py"
_LEASE = "services/haptic_server/gateway/lease.py"
_ENVELOPE = "shared/drumstick/safety/envelope.py"
_BOUNDS = "shared/drumstick/safety/bounds.py"
_SAMPLED = "shared/drumstick/safety/sampled_contact.py"

# (file, line as it is): any other number there is as good.
_ANY_NUMBER: dict[tuple[str, str], str] = {
    **{
        (_MESSAGES, line): _CAMERA
        for line in (
            '"wxyz": [1.0, 0.0, 0.0, 0.0],',
            '"position": [3.0, 3.0, 3.0],',
            '"look_at": [0.0, 0.0, 0.0],',
            '"up_direction": [0.0, 0.0, 1.0],',
            '"fov": 1.0,',
            '"near": 0.01,',
            '"far": 1000.0,',
            '"image_height": 1,',
            '"image_width": 1,',
        )
    },
    (_FENCE, "record: Any = words[0]"): "the only element of an array of one: -1 is 0",
    (_BOUNDS, "_ROOT_STEPS = 60"): "the root is found long before, to the last bit",
    (_BOUNDS, "_BISECTIONS = 40"): "one halving more or less moves the bound by a part in 10^10",
    (
        _BOUNDS,
        "_CLOSE = 1e-12",
    ): "Newton's last step doubles the digits: half or twice as close is the same number",
    (_BOUNDS, "UNBOUNDED_M_PER_S = 1e300"): "any number that no speed reaches",
}

for _code in ("STIFF", "LATE", "SELF_DRIVEN", "COUNT_LIMIT_CYCLE", "COUNT_OSCILLATION"):
    _ANY_NUMBER[_ENVELOPE, f"return {_code}, 0.0, 0"] = "`judge` looks at nothing but the code of a refusal"
for _code in ("HAND", "ENDLESS", "SPEED", "FORCE", "THROW"):
    _ANY_NUMBER[_ENVELOPE, f"return {_code}, 0.0"] = "`judge` looks at nothing but the code of a refusal"

# (file, line as it is, line as mutated).
_THIS: dict[tuple[str, str, str], str] = {
    (
        _MESSAGES,
        "return False",
        "return None",
    ): "`admits` asks only whether it is true, and answers with its own",
    (
        _PANEL,
        '("/", {"Host": "elsewhere.example"}, HTTPStatus.MISDIRECTED_REQUEST),',
        '("/", {"Host": \'XXelsewhere.exampleXX\'}, HTTPStatus.MISDIRECTED_REQUEST),',
    ): "any foreign name will do",
    (
        _FENCE,
        "fence[at] = (1, quantity.low, quantity.high, 0)",
        "fence[at] = (1, quantity.low, quantity.high, 1)",
    ): "where a number is live, nobody looks at the word",
    (
        _FENCE,
        "fence[at] = (1, quantity.low, quantity.high, 0)",
        "fence[at] = (2, quantity.low, quantity.high, 0)",
    ): "live is whatever is not 0",
    (
        _LEASE,
        'self._name = ""',
        "self._name = 'XXXX'",
    ): "a lease that nobody took has ended: its name is not told",
    (
        _BOUNDS,
        "newton = t - z / speed",
        "newton = t / (z / speed)",
    ): "a step that leads out of the bracket, or nowhere, is a bisection: the same root",
    (
        _SAMPLED,
        "return (1.0 - c) * arm.period_s * arm.period_s / bend if bend > 1e-6 else 0.5 * arm.period_s**2",
        "return (1.0 - c) * arm.period_s * arm.period_s / bend if bend >= 1e-06 else 0.5 * arm.period_s**2",
    ): "at the border both are the same but for rounding",
    (
        _BOUNDS,
        "return math.exp(-math.pi * a / math.sqrt(w2 - a * a)) if w2 > a * a else 0.0",
        "return math.exp(-math.pi * a / math.sqrt(w2 - a * a)) if w2 >= a * a else 0.0",
    ): "kernels divide by zero as IEEE 754 does: at the border the exponent is minus infinity, which makes 0 too",
    (
        _SAMPLED,
        "return worst_rebound(heaviest, head, window, scratch) < most_rebound(heaviest, head)",
        "return worst_rebound(heaviest, head, window, scratch) <= most_rebound(heaviest, head)",
    ): "a blow played tick by tick would have to meet the bound to the last bit",
    (
        _SAMPLED,
        "own = contact.beta(head.release, arm.m, head.k, head.r) if head.r >= 0.0 else 1.0",
        "own = contact.beta(head.release, arm.m, head.k, head.r) if head.r >= 0.0 else 2.0",
    ): "anything above _MAX_OWN is cut to it",
}


def reason_of(mutant: Mutant) -> str | None:
    """Reason why this mutant does not count, or None: it does."""
    if mutant.kind == "Number" and (mutant.path, mutant.removed) in _ANY_NUMBER:
        return _ANY_NUMBER[mutant.path, mutant.removed]
    if (
        mutant.path == _ENVELOPE
        and mutant.kind == "Number"
        and mutant.added.replace("[-1]", "[0]") == mutant.removed
    ):
        return "the only element of an array of one: -1 is 0"
    return _THIS.get((mutant.path, mutant.removed, mutant.added))
