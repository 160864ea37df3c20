"""Just noticeable differences (JND): the least that an ear or a hand can tell from another. Pure.

Thresholds are of trained listeners, of steady tones, alone and in quiet. A drum's partials decay, and others sound
beside them; both make a difference harder to tell (Micheyl, Xiao, Oxenham, "Characterizing the dependence of pure-tone
frequency difference limens on frequency, duration, and level", 2012: their logarithms fall with the root of duration).
For decaying inharmonic partials there is no such table, so the stricter one of steady tones is taken: what lies below
it is not heard on a drum either.
"""

import math

# Wier, Jesteadt, Green, "Frequency discrimination as a function of frequency and sensation level", J. Acoust. Soc. Am.
# 61, 1977: log10(JND in Hz) = 0.026 sqrt(f in Hz) - 0.533 at 40 dB above threshold, measured from 200 Hz to 8 kHz.
# Below 200 Hz it goes on falling where ears do not: stricter than they are.
_PER_ROOT_HZ, _LOG_AT_0 = 0.026, -0.533
# There the JND is the least part of the frequency: where d/df (0.026 sqrt(f) - log10 f) = 0.
_SHARPEST_Hz = (2.0 / (_PER_ROOT_HZ * math.log(10.0))) ** 2


def pitch_jnd_cents(f_Hz: float) -> float:
    """Just noticeable difference in frequency of a tone, cents: 7 at 150 Hz, 3.4 at 1 kHz, 5.6 at 4 kHz."""
    return 1200.0 * math.log2(1.0 + 10.0 ** (_PER_ROOT_HZ * math.sqrt(f_Hz) + _LOG_AT_0) / f_Hz)


def sharpest_Hz(low_Hz: float, high_Hz: float) -> float:  # noqa: N802
    """Frequency between these two at which the ear tells the fewest cents."""
    return min(max(_SHARPEST_Hz, low_Hz), high_Hz)


# Jesteadt, Wier, Green, "Intensity discrimination as a function of frequency and sensation level", J. Acoust. Soc. Am.
# 61, 1977: of two tones the louder one is named rightly in some 71 of 100 trials; 0.463 (I / I0)**-0.072 of the
# intensity at every frequency from 200 Hz to 8 kHz, which is 0.93 dB at 40 dB above threshold, 0.50 dB at 80 dB.
LEVEL_dB = 1.0
# Jarvelainen, Tolonen, "Perceptual tolerances for decay parameters in plucked string synthesis", J. Audio Eng. Soc. 49,
# 2001: a time of decay from 25 % shorter to 40 % longer is not told apart; the stricter side.
DECAY = 0.25
# Adelstein, Begault, Anderson, Wenzel, "Sensitivity to haptic-audio asynchrony", 2003: between the tap of a hammer and
# its sound. Percussionists rate a steady 10 ms like none (Jack, below), so this is the one to be told apart.
LATENCY_s = 0.024
# Jack, Mehrabi, Stockman, McPherson, "Action-sound latency and the perceived quality of digital musical instruments",
# Music Perception 36(1), 2018, percussionists and amateurs at 0, 10, 10 +- 3 and 20 ms from stroke to sound: 10 ms is
# rated like none, 20 ms worse, 10 +- 3 ms worse.
LATENCY_LIKE_NONE_s, LATENCY_WORSE_s = 0.010, 0.020
# The spread to either side. Stricter than the 6 ms by which one tone of a fast even sequence can be moved (Friberg,
# Sundberg, "Time discrimination in a monotonic, isochronous sequence", J. Acoust. Soc. Am. 98, 1995).
LATENCY_SPREAD_s = 0.003
# Wessel, Wright, "Problems and prospects for intimate musical control of computers", Computer Music Journal 26(3),
# 2002: a goal for instruments, beside the same 10 ms: from the soonest to the latest no more than this.
LATENCY_SPREAD_GOAL_s = 0.001
# Bergmann Tiest, Kappers, "Cues for haptic perception of compliance", 2009: 15 % of a stiffness. For the impulse of a
# blow no threshold is known to us, and it stands for that too.
STIFFNESS = 0.15
