"""Hard cases of the stick."""

from stability.case import Case

CASES = (
    Case(
        "stiff contact",
        "stick",
        hard="K_coll = 1e6 N/m under 15 g: the whole contact lasts 0.4 ms, a light stick's 0.03 ms.",
        naive="Four methods at 1 kHz without event location throw an undamped stick out at three to a"
        " million times the"
        " speed of the blow, and lose it.",
        ours="Each piece of motion in closed form, events found between its nodes: the same speed for a"
        " hundred contacts.",
        bound="Naive: 3 times, the first contact's least (implicit midpoint). Ours: 1e-11, the rounding of"
        " the contacts.",
    ),
    Case(
        "contact of a few steps",
        "stick",
        hard="A step that ends deep in the head has given the stick the energy of that spring.",
        naive="A fixed step of half a radian, even of a method that keeps energy, lets speeds grow by a"
        " quarter;"
        " every method falls to order one.",
        ours="A step is cut at its event: the method keeps its order, and midpoint its energy.",
        bound="Naive: 0.5 m/s where 0.4 m/s came in. Ours: 1e-9, the tolerance of the event's search.",
    ),
    Case(
        "graze",
        "stick",
        hard="The stick comes down to 1e-12 m in or above the head, or up to as little out of it.",
        naive="Fixed steps of 1 ms see none of ten grazes of 1e-9 m, and at most half of those of 1e-6 m.",
        ours="Height is monotone between its nodes, so a change of sign is never missed, and the speed"
        " found matches the depth.",
        bound="Relative error of the speed 1e-16 m / depth: float64's resolution of a height there.",
    ),
    Case(
        "nearly a full swing",
        "stick",
        hard="A hand that lifts far more than the stick moves: what comes back is the small rest of a large swing.",
        naive="The closed form's own speed there is the rest of large numbers: 1e-16 over the square of the ratio.",
        ours="By energy, summed from z = 0 to z = 0: what the numbers' own rounding does, and no more.",
        bound="Ours: 1e-14 times one and the condition number, in one go and in 500 ticks; the instant 1e-13.",
    ),
    Case(
        "dead roll",
        "stick",
        hard="Below the capture speed the stick never comes out again, so no exit brings a pulse.",
        naive="A fixed step of 1 ms leaves the head by energy of its own making, and rolls on for ever.",
        ours="Whether it can still come out is known from the motion itself: captured, no contact.",
        bound="Counts: none against more than ninety contacts in five seconds.",
    ),
    Case(
        "pulse shorter than a step",
        "stick",
        hard="A pulse of m dv/tau newtons for tau = 1 us to 0.1 ms.",
        naive="Held over a step of 1 ms it gives dv T/tau: 3.5 to 270 m/s in place of 0.67.",
        ours="The pulse is part of the closed form, whatever its length.",
        bound="Naive: 4 times. Ours: 30 tau, the pulse's own effect on the contact, from its first order in"
        " tau.",
    ),
    Case(
        "pulses that overlap",
        "stick",
        hard="tau = 0.5 s and a roll at 14 Hz: each pulse finds seven others still going on.",
        naive="A loop that has one pulse forgets what is left of the last: less than half the speed.",
        ours="All pulses fade alike, so their sum is one number: m dv for each contact, a geometric series.",
        bound="1e-6 of the series' sum: how far the cycle has settled in 30 s.",
    ),
    Case(
        "no hand",
        "stick",
        hard="K_hand = 0 or 1e-300 N/m: the flight has no frequency any more.",
        naive="The usual closed form divides by w^2 and w: NaN.",
        ours="Differences of exponentials are taken as such: a straight line for K_hand = 0, the right"
        " parabola near it.",
        bound="1e-13: rounding.",
    ),
    Case(
        "damping at and beyond critical",
        "stick",
        hard="zeta of 1, of 1 + 1e-12 and above: the contact has no swing.",
        naive="The formulas of the swing, sqrt(1 - zeta^2) and acos(zeta), give NaN.",
        ours="One form for all zeta; a head that only pushes lets go at exp(-2 zeta acosh(zeta)/sqrt(zeta^2"
        " - 1)).",
        bound="1e-6 at 1 + 1e-12, where the formula that it is held against itself has lost half of its"
        " digits.",
    ),
    Case(
        "equal eigenvalues",
        "stick",
        hard="A pulse that fades just as the contact does, 1/tau equal to an eigenvalue, or to 1e-14 of it.",
        naive="Partial fractions divide by the difference of the two: NaN, or no digit that is right.",
        ours="Divided differences, which have a limit there: 1e-11 of the solution in 50 digits.",
        bound="Naive: 1e-9 m where the stick is at 0, a thousand times what ours is off. Ours: 1e-11,"
        " rounding.",
    ),
    Case(
        "roll of a million contacts",
        "stick",
        hard="Half a day of playing: whatever is lost or made at a contact adds up a million times.",
        naive="Steps of 1 ms play a roll that is slower by a tenth, of 0.1 ms by a hundredth, and uneven.",
        ours="Rate and every contact's instant to 1e-14 of the solution in 40 digits, by a clock that keeps"
        " what it rounds.",
        bound="Naive: 0.1 and 0.01, as measured 0.12 and 0.013. Ours: 1e-14, the last places of the period"
        " itself.",
    ),
    Case(
        "creeping stick",
        "stick",
        hard="So damped a head that the stick dies away below z = 0 and never arrives there.",
        naive="A step of 1 ms, or of 10 us, is longer than all that happens (0.3 us), and throws the stick"
        " out.",
        ours="It is at rest in the head when its motion has become nothing: captured.",
        bound="No numbers: left against captured.",
    ),
    Case(
        "effects at the ends of their ranges",
        "stick",
        hard="Every registered effect with each number at either end and each choice, on stiff, light and"
        " soft sticks.",
        naive="On the stiff stick a fixed step of 1 ms is wrong about one of the first three speeds in most"
        " corners.",
        ours="Every event moves on, no NaN, contacts that are possible.",
        bound="Naive: off by a twentieth in seven corners of ten. Ours: what must hold at any event.",
    ),
    Case(
        "any numbers of the tables",
        "stick",
        hard="Four decades of mass, six of stiffness, a hand of any strength, drawn at random and tried at"
        " the corners.",
        naive="Of undamped sets, most make energy at 1 kHz.",
        ours="No NaN, no endless loop, energy that never grows, the same events however a run is split.",
        bound="Naive: a tenth of the speed, in half of the sets. Ours: 1e-9, rounding next to a strong"
        " hand's energy.",
    ),
    Case(
        "bounces without number",
        "stick",
        hard="A head that keeps 0.4 % of a blow's speed: 1,600 ever smaller bounces in 40 s, and then rest.",
        naive="By steps of 0.1 ms, of any of four methods, the small bounces feed themselves: it never comes to rest.",
        ours="Each bounce at its instant, and captured after the last.",
        bound="As many contacts as by bisection of each, instants to 1e-10 s, speeds to 1e-9: rounding that 1,600"
        " bounces carry on (2e-12 s and 9e-11 were measured).",
    ),
    Case(
        "balanced stick",
        "stick",
        hard="z_ss = 0 and a pulse into the drum that fades more slowly than the contact swings back: the stick creeps"
        " up to z = 0 for ever, until its numbers are too small to tell a sign.",
        naive="The crossing at last is taken for a strike, fires the pulse at the entry, and the stick strikes about"
        " once a second for ever.",
        ours="What crosses at less than 1e-30 m/s, with nothing that presses or lifts it, lies still: captured.",
        bound="Counts: two contacts in ten minutes against more than forty in one.",
    ),
    Case(
        "hand stiffer than the head",
        "stick",
        hard="K_hand of 1e4 N/m on a head of 1 to 1000 N/m.",
        naive="Equation (3) leaves the hand out: a contact that lasts more than three times as long, and a rebound that"
        " is slower by more than a tenth of the blow.",
        ours="Both springs are in the contact's equation.",
        bound="1e-12 of the closed form of K_coll + K_hand: rounding.",
    ),
    Case(
        "head softer than the hand's damper",
        "stick",
        hard="R_in < R_out: the head's own damper is negative, so that at z = 0 it would pull.",
        naive="Asked at the entry whether it pushes, the head says no, and the stick goes through it.",
        ours="It lets go and holds within one contact, as often as its push changes sign.",
        bound="Naive: three times the depth. Ours: one contact a blow, never faster than it came.",
    ),
    Case(
        "both releases at once",
        "stick",
        hard="R_in = R_out: the head stops pushing just where z = 0, and at the entry its push is exactly 0.",
        naive='Asked at the entry whether it pushes ("> 0"), it does not, and the stick goes through it.',
        ours="Release by force and release by height are the same contacts.",
        bound="Naive: three times the depth. Ours: 1e-11 over two seconds of a roll, rounding.",
    ),
    Case(
        "hand that gives energy",
        "stick",
        hard="R_out < 0: a hand that pushes along with whatever moves.",
        naive="Played as it is given, 0.4 m/s become more than 1 m/s without a pulse.",
        ours="Refused in words: in a scene, at the gateway and in the servo.",
        bound="Naive: 2.5 times (2.9 was measured). Ours: no numbers, the set that was there plays on.",
    ),
    Case(
        "pulse at the entry",
        "stick",
        hard="The drum hears of a contact as it begins, and the pulse that begins with it changes its force.",
        naive="Announced from mass, head and speed alone, force, length or impulse is off by a fifth and more.",
        ours="The contact is played ahead, with the pulse, on a copy of the stick.",
        bound="1e-9 of the contact that follows, the event search's rounding.",
    ),
)
