"""Hard cases of the servo."""

from stability.case import Case

CASES = (
    Case(
        "head stiffer than the device",
        "servo",
        hard="3500 N/m on 75 g at 1 kHz with a tick of delay: the force lags by a tick and a half.",
        naive="The plain law gives the arm back 1.3 times the speed of its blow, at every phase of the tick.",
        ours="The envelope refuses the set, at the gateway and in the servo; the guard's passivity controller"
        " holds back what"
        " still comes through.",
        bound="Naive: 1.3, as measured. Ours: 1.1, what the account's slack of 1 % and a tick of unseen"
        " motion allow.",
    ),
    Case(
        "late device",
        "servo",
        hard="Position comes at ticks, force is held until the next: a late spring is a negative damper,"
        " R_in - K T/2.",
        naive="Without prediction the rebound is that of the smaller damping, at least a twentieth too fast.",
        ours="Position is led by T/2 and the device's delay: the rebound is the design's.",
        bound="2 % of the closed form, the mean of 16 phases of the tick.",
    ),
    Case(
        "speed from encoder counts",
        "servo",
        hard="A count of 0.03 mm in a tick is 30 mm/s, and noise flips the count.",
        naive="The difference of two positions buzzes with 0.05 N and more on a stick that lies still;"
        " filtered until it is"
        " calm, it is late by a large part of the contact.",
        ours="A window as long as a straight line explains the counts: calm at rest, short in a blow.",
        bound="Calmer by 4 (7 was measured); 12 % of the blow's speed, of which half a tick's lag is 10 %.",
    ),
    Case(
        "NaN from the device",
        "servo",
        hard="NaN is neither below nor above anything.",
        naive='A limit written as "refuse if x > limit" lets it pass; the head has no force any more and no '
        "fault; a filter"
        " never recovers.",
        ours='Inputs are accepted only if "x <= limit" holds, which NaN never does: zero force and a latched '
        "fault on the same tick; armed"
        " again, it plays on.",
        bound="No numbers: force 0.0, the fault's code.",
    ),
    Case(
        "stall",
        "servo",
        hard="The machine stands still for 1 to 30 ms in mid-contact, and the hand goes on.",
        naive="Over the usual period the way of a stall is a speed of metres per second: a kick beyond the"
        " motor's limit.",
        ours="The span is measured; beyond 5 ms no force until the stick was above the head, beyond 20 ms a"
        " fault.",
        bound="The device's force, the slew of 20 N a tick, and what spring and true speed ask for.",
    ),
    Case(
        "parameter jump in contact",
        "servo",
        hard="A change of K_coll by dK in the head adds dK z^2/2 to the stick.",
        naive="Three times the stiffness at the deepest point: the stick leaves at sqrt(3) times the speed.",
        ours="What shapes the contact is latched above the head only; the guard's passivity observer counts the"
        " rest.",
        bound="Naive: 1.6 times, below the root of 3 by the hand's part. Ours: the same bytes as without"
        " the change.",
    ),
    Case(
        "negative damping behind a clamp",
        "servo",
        hard="R_in = -5 N s/m with a limit of 8 N: every single force is allowed.",
        naive="A clamp alone: the arm hammers for ever, a twentieth of the time at the limit, ever higher.",
        ours="The envelope judges the whole set: refused in words.",
        bound="A simulation of ten seconds; half of what it was measured to do.",
    ),
    Case(
        "too much rendered damping",
        "servo",
        hard="R_in is rendered from a late speed too: at R_in T/m of order one it feeds what it should take.",
        naive="A bound of the damper from below only, and a limit of force: a held arm hammers for ever at that"
        " limit.",
        ours="The poles of the sampled loop and the rebound of a blow bound R_in from both sides; the guard carries"
        " what the head gave too much from contact to contact.",
        bound="Naive: ten blows in the last 3 s, with 3.5 N and more. Ours: 0.01 m/s, and with the guard alone"
        " three quarters of what it was without.",
    ),
    Case(
        "pulse sampled at ticks",
        "servo",
        hard="tau = 4 ms against ticks of 0.25 to 2 ms.",
        naive="The pulse's value at each tick, held, gives up to 27 % too much speed, by another share at"
        " another rate.",
        ours="The held force is the pulse's mean over the tick: m dv at any rate.",
        bound="Naive: T/(2 tau), its first order. Ours: 1e-6, what is left of the pulse after 0.1 s.",
    ),
    Case(
        "month of ticks",
        "servo",
        hard="2.6e9 ticks; clocks and counters beyond 2^31, 2^32, 2^53.",
        naive="Milliseconds in 32 bits wrap after 24.9 days: a burst of a stroke at every tick, then a second"
        " of silence. Float32 seconds stand still after hours, a sum of periods drifts.",
        ours="int64 nanoseconds and counts; the stick does not know how late it is: the same bytes as on"
        " the first day.",
        bound="To the last bit, and strikes within 2 ns of the cycle in 40 digits: written in whole ns, one"
        " to spare.",
    ),
    Case(
        "set of another thread",
        "servo",
        hard="A set of parameters arrives from another process while a tick reads it.",
        naive="Copied in place it is half old and half new for as long as the writer is held up.",
        ours="A triple buffer: the writer writes where nobody reads, and an exchange shows it whole.",
        bound="No numbers: none torn, of ten million; and one that is stopped half way.",
    ),
    Case(
        "throw outside the guard",
        "servo",
        hard="1 kg at 5 m/s on 1e6 N/m: every number is in its range.",
        naive="Checked one by one they pass, and the first blow has more than 4000 N under a limit of 100 N.",
        ours="The envelope foresees the throw that the scene asks for: refused, with its force and speed.",
        bound="Naive: 40 times the limit. Ours: no numbers.",
    ),
    Case(
        "arm mass other than the scene's",
        "servo",
        hard="A pulse is m dv, and the arm has a mass of its own.",
        naive="A set of 1 kg in front of an arm of 75 g: each pulse is thirteen times as fast as it says, and the arm"
        " passes the limit of speed.",
        ours="A stick heavier than the heaviest arm of this make is refused, the guard's budget is never of more than"
        " the arm's mass, and an arm 15 % lighter or 20 % heavier than declared rolls on.",
        bound="Naive: the fault's code. Ours: no fault and no gap of 0.1 s in a minute.",
    ),
    Case(
        "driver that lets go above its limit",
        "servo",
        hard="Some drivers send no force at all in place of one above their limit.",
        naive="A head of 3500 N/m asks for 8.5 N at 2.4 mm: a blow of 1.2 m/s gets through, and the deeper it is the"
        " less it is held.",
        ours="The guard limits the force to the device's before it is sent, so that no driver has to.",
        bound="Naive: 20 mm deep and still down at 0.5 m/s. Ours: less than 20 mm, and out again.",
    ),
    Case(
        "slow blow that turns between two counts",
        "servo",
        hard="A move of less than two counts of the encoder is no motion to the guard's account of energy; at 6 cm/s a"
        " stick turns within one.",
        naive="Moves that wait get the newest force when they are counted: too much on the way down, too little on the"
        " way up. An account of that kind misses some of the work of each blow, and a head without a damper took an arm"
        " from 0.06 to 0.24 m/s in four hundred contacts.",
        ours="Until a blow has turned, its last tick has its own force and those before it the mean of their extremes;"
        " the turn is charged what the stick may have got unseen. A head that should add nothing keeps a hundredth of"
        " each blow.",
        bound="Naive: 2 % of a blow's energy missed. Ours: 1 % at most, or 4 % found too much; over two thousand"
        " contacts no faster than at first, but for a count within a tick, and in the end no faster than two counts"
        " in a tick.",
    ),
    Case(
        "account of thousands of contacts",
        "servo",
        hard="Damped contacts take energy, and late ones give some, a thousand times in a minute.",
        naive="A classical passivity observer is never begun anew: what a thousand damped contacts took, a head that is"
        " late by a tick spends again, until the arm is at 2 m/s. Without one it is there at once.",
        ours="What a contact gave too much is owed by the next for as long as it takes; what it kept is not saved.",
        bound="Naive: 2 m/s from 0.3. Ours: never more than the 0.3 m/s it began with; a debt of 1 uJ a contact to"
        " 1e-11 over five thousand.",
    ),
    Case(
        "compile pause at a change of scene",
        "servo",
        hard="Another scene has another loop, which takes a compiler ten seconds: no stick may stand still for that.",
        naive="Compiled, or loaded, when its first tick is due: as many ticks are left out as that takes.",
        ours="The next servo compiles its loop on a spare memory and waits, while the present one plays on.",
        bound="Kinds of loop compiled at the first tick. Naive: 1, and at least 10 ticks left out. Ours: none.",
    ),
)
