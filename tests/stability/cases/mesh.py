"""Hard cases of the mesh."""

from stability.case import Case

CASES = (
    Case(
        "hundred million steps",
        "mesh",
        hard="199 junctions without losses for 1e8 steps in float32: 2e10 updates, each rounded.",
        naive="Textbook orders of the same sum gain 2.4 % or 0.5 %, or lose 0.3 %, in two million steps,"
        " always in one sense.",
        ours="u- is added last, by a fused multiply and add: 2e-4 after 1e8 steps, to and fro.",
        bound="Naive: a half of what half a million steps were measured to do. Ours: 1e-3, four times what"
        " was measured.",
    ),
    Case(
        "faster than the limit",
        "mesh",
        hard="At tau = 8/3 the highest mode advances by the phase pi per step; beyond, it grows.",
        naive="2 % faster explodes within two thousand steps.",
        ours="No scene can ask for it: tau is lowered for losses, glide and air before the lattice is built.",
        bound="1e12 times the energy it began with, at which the run is stopped; q of every mode to 1e-12"
        " of the limit.",
    ),
    Case(
        "junction beside the rim",
        "mesh",
        hard="The rim cuts the edge to a neighbour at 2 % of its length.",
        naive="A neighbour reflected at the rim, -(1 - theta)/theta u, has a mode beyond any limit: even"
        " tau = 2 explodes.",
        ours="A cut edge is an admittance of 1/theta, and the junction the lighter for it: no mode above"
        " max_eigenvalue.",
        bound="Eigenvalues: above 4 against below 1.5, the mesh's own.",
    ),
    Case(
        "blow of a million newtons",
        "mesh",
        hard="100 dB above full scale.",
        naive="Samples cast to 16 bits wrap round: a third of the loud ones change their sign.",
        ours="Refused at the sound server; past it the limiter bends it, and the next stroke sounds as if it had"
        " not been.",
        bound="One bit of 24 after it has died away.",
    ),
    Case(
        "steady push",
        "mesh",
        hard="A force that never ends bends the head for good.",
        naive="A pickup that hears where the head is puts a constant into the output.",
        ours="Pickups hear u+ - u, which has none.",
        bound="Naive: a tenth of the bend. Ours: 1e-5 of the onset, float32's rounding of the bend from"
        " step to step.",
    ),
    Case(
        "noise",
        "mesh",
        hard="A blow of full scale in every step, at random places, for twenty thousand steps.",
        naive="A glide by the tension of a step ago feeds on it and overflows.",
        ours="With every effect at once it comes to a level, stays there, and dies away afterwards.",
        bound="1.5 between two halves: the spread of the largest of ten thousand.",
    ),
    Case(
        "tail of denormal numbers",
        "mesh",
        hard="A sound that dies away in float32 ends in numbers below 1e-38, which x86 computes up to 150"
        " times slower.",
        naive="Without the float mode the tail is made of such numbers; it cost 40 times the stroke.",
        ours="They are zero on the audio thread, so a tail costs no more than a stroke does.",
        bound="No such number is left in the drum, neither at 1e-36 nor at 1e-40 of the stroke; naive: over 1000.",
    ),
    Case(
        "hour of silence",
        "mesh",
        hard="A drum that nobody strikes for an hour.",
        naive="A head that never sleeps takes every step of it.",
        ours="180 dB down it is set to 0 and not computed; the next stroke sounds as the first one did.",
        bound="8192 steps, two looks at the head; exactly 0 and the same samples.",
    ),
    Case(
        "places on the rim and beyond",
        "mesh",
        hard="Strokes and pickups at a radius of 1, of 1.3, of 1000.",
        naive="A flat index from rounded coordinates leaves the head, or the array; what it pushes there"
        " rings on for ever.",
        ours="Places are drawn in until all junctions around them lie on the head; outside stays exactly 0.",
        bound="Energy to 1e-4 over ten thousand steps: float32's rounding.",
    ),
    Case(
        "another drum in every block",
        "mesh",
        hard="Tuning, level and type of engine change with each block of 10 ms, while all ring.",
        naive="Dropped in mid-sound each drum clicks; tuned in place, a ringing head is pumped up a"
        " millionfold.",
        ours="Each tuning is a drum of its own, and the one before fades out beside it.",
        bound="The jump at a change: 3 times less, on the median (7 was measured).",
    ),
    Case(
        "force that is no number",
        "mesh",
        hard="NaN is handed on from junction to junction.",
        naive="In as many steps as there are junctions across, all of the head is NaN, for good.",
        ours="Dropped and counted at the sound server: the drum does not hear of it.",
        bound="No numbers: none played, all counted.",
    ),
    Case(
        "strikes a sample apart",
        "mesh",
        hard="Hundreds of strikes, each a sample after the last, so that dozens act at once.",
        naive="A drum with one pulse drops what is left of each strike at the next: more than half of the motion is"
        " missing.",
        ours="32 pulses at once, each whole: the sum of all, as if each had come alone. Of more than 32 at once, which"
        " no stick plays, the oldest end early.",
        bound="2e-5 of the sum: float32's rounding, some hundred times.",
    ),
)
