"""Hard cases of the wire."""

from stability.case import Case

CASES = (
    Case(
        "strikes late, lost and doubled",
        "wire",
        hard="A stage's wireless network: 5 to 200 ms, a twentieth lost, a twentieth twice, others"
        " overtaken.",
        naive="Played on arrival, doubled strikes sound twice, and a tenth of all sound 25 ms and more"
        " beside any contact.",
        ours="Each strike is named, and sounds once, at its contact plus the scene's latency, or is counted"
        " as late.",
        bound="True to what the clocks can know (0.3 to 12 ms); nothing more than 50 ms beyond its instant.",
    ),
    Case(
        "clocks that drift apart",
        "wire",
        hard="Clocks that differ by 100 ppm drift apart by 60 ms in ten minutes.",
        naive="One comparison for ever: after ten minutes strikes come too late to be played.",
        ours="Drift is estimated from round trips, and its error is bounded.",
        bound="As above; the naive one must lose strikes within a quarter of an hour.",
    ),
    Case(
        "clock that is set",
        "wire",
        hard="Somebody sets the wall clock while a roll is played.",
        naive="Timed by the wall clock, every later strike counts as two seconds late and is dropped.",
        ours="Monotonic clocks only: not a nanosecond's difference.",
        bound="Counts: 50 of 100 against none.",
    ),
    Case(
        "pause of the network",
        "wire",
        hard="Three seconds of strikes wait in buffers and come at once.",
        naive="75 strokes in one instant.",
        ours="What is more than 50 ms beyond its instant is dropped and counted.",
        bound="Counts, from the 50 ms.",
    ),
    Case(
        "streamed force that jitters",
        "wire",
        hard="Pieces of a contact's force come a millisecond early or late, twice, out of order, or never.",
        naive="Held from their arrival on, samples overlap and leave gaps: the impulse is off by some per"
        " cent.",
        ours="Samples have numbers and instants: every impulse arrives whole, on its time.",
        bound="Naive: 2 %. Ours: 1e-6 of the sum of impulses, float32's rounding.",
    ),
    Case(
        "NaN in a message",
        "wire",
        hard="NaN and infinity are numbers of the format.",
        naive='The reader of the format takes them, and limits written as "refuse if x > limit" let NaN through.',
        ours="Every message's numbers are finite, or it is refused by the field's name.",
        bound="No numbers: refused.",
    ),
    Case(
        "message that never ends",
        "wire",
        hard="24 bytes of a bundle whose element ends before it begins; two thousand arrays in each other.",
        naive="The usual parser reads the same element for ever; the usual reader ends by an exception that"
        " nobody expects.",
        ours="A scan in one pass before anything is parsed; every other exception is a refusal.",
        bound="100,000 lines of Python against 200: no clock.",
    ),
    Case(
        "flood of nonsense",
        "wire",
        hard="Ten thousand bad messages in three seconds.",
        naive="A line in the log, and an answer, for each.",
        ours="One line a second that counts the others; answers are capped by source and in all.",
        bound="4 lines in three seconds.",
    ),
    Case(
        "reader that stands still",
        "wire",
        hard="A gateway that was stopped while the servo plays on.",
        naive="A queue without an end keeps all that nobody reads.",
        ours="A ring of its own length: what does not fit is dropped and counted, and the tick goes on.",
        bound="Counts: each drop a gap, each gap a drop.",
    ),
    Case(
        "counter beyond 31 bits",
        "wire",
        hard="A rig that has struck 2^31 times.",
        naive="The usual builder sends 64 bits (`h`), which neither Pd nor SuperCollider reads.",
        ours="What goes out by OSC starts again at zero after 31 bits.",
        bound="The same bytes as for the small number.",
    ),
)
