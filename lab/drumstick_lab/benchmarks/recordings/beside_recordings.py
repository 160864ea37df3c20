"""Drums beside recorded ones: drumstick lab beside-recordings KITS [--scenes tom snare ...] [--held-out].

KITS is the folder of Debian's hydrogen-drumkits (`apt-get download hydrogen-drumkits`, `dpkg-deb -x` it: usr/share/
hydrogen/data/drumkits). Each scene is struck five times, from its softest stroke to full scale, the drums of a drum set
at 0.3 of the radius and the others where their scene plays them (`place`), and set beside recorded drums of the same kind: levels of five bands to the whole (30 Hz up, 1.5 s), softest and hardest;
by how much 1-8 kHz rise from the softest to the brightest; flatness between 0.5 and 8 kHz; T60 by octave of the hardest;
and the mean distance of the band levels over all dynamics, dB. Scenes are made beside the kits of `WORK`; --held-out
judges by the others, and shall be asked seldom, so that nothing is fitted to them. No kit has a conga: `conga` was made
beside other hand drums, open tones of five djembes, one dynamic each, and is judged by two bongos. (The congas of
ElectricEmpireKit are synthesised, as its author says.) Drums of which no kit has a recording are measured alone. Recorded drums are judged by the held-out kits, but for their own, as the scenes are. With
--scenes the others stay as they were stored. Kits whose dynamics were made equally loud afterwards count as they are:
levels are told to the whole stroke's.
"""

import argparse
import itertools
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drumstick.drum.calibrate import strike_for_speed
from drumstick.drum.render import render
from drumstick.parameters.scene import Scene
from drumstick_lab.measuring import stored
from drumstick_lab.measuring.made_beside import ALSO_BESIDE, KINDS, PLACE, place_of, scene_of

RATE_HZ = 48_000
EDGES_HZ = (500.0, 1000.0, 2000.0, 4000.0, 8000.0, 16000.0)
THIRDS_HZ = tuple(1000.0 * 2.0 ** (k / 3.0) for k in range(-14, 13))  # 39 Hz to 16 kHz, middles
OCTAVES_HZ = (63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
STROKES, SECONDS = 5, 2.5

_FIVE = ("Softest", "Soft", "Med", "Hard", "Hardest")
# Kind -> name -> files, softest first.
WORK: dict[str, dict[str, list[str]]] = {
    "tom": {
        **{f"Forzee {t}": [f"ForzeeStereo/Tom{t}-{i}.wav" for i in range(5)] for t in ("High", "Mid", "Low")},
        **{
            f"Colombo {size}": [f"ColomboAcousticDrumkit/tom-{t}-1.flac"]
            for size, t in (("12-inch", "hi"), ("13-inch", "mid"), ("16-inch", "low"))
        },
    },
    "snare": {
        "Forzee snare": [f"ForzeeStereo/Snare-{i}.wav" for i in range(5)],
        "Forzee snare, wires off": [f"ForzeeStereo/SnareOff-{i}.wav" for i in range(5)],
    },
    "bass drum": {
        "Forzee bass drum": [f"ForzeeStereo/Kick-{i}.wav" for i in range(5)],
        "Colombo bass drum": [
            f"ColomboAcousticDrumkit/bassdrum-4mics-br-stereo-{level}.flac"
            for level in ("soft2", "soft4", "normal3")
        ],
    },
    "hand drum": {f"Djembe {i}": [f"circAfrique v4/Djembe{i} Tone.wav"] for i in range(1, 6)},
}
HELD_OUT: dict[str, dict[str, list[str]]] = {
    "tom": {
        **{
            f"Black Pearl {t}": [f"The Black Pearl 1.0/PearlTom{t}-{level}.wav" for level in _FIVE]
            for t in ("1", "2", "Floor")
        },
        "BJA": [f"BJA_Pacific/TM_{i:02d}.aiff" for i in range(1, 9)],
        "BJA floor": [f"BJA_Pacific/TM2_{i:02d}.aiff" for i in range(1, 9)],
        "Millo 2": [f"Millo_MultiLayered2/tom_{i:02d}.flac" for i in range(1, 5)],
        "Millo 2 floor": [f"Millo_MultiLayered2/floortom_{i:02d}.flac" for i in range(1, 5)],
        **{
            f"Millo 3 {t}": [f"Millo_MultiLayered3/{t}_{i:02d}.flac" for i in range(1, 4)]
            for t in ("t1", "t2", "ft")
        },
    },
    "snare": {
        "Black Pearl": [f"The Black Pearl 1.0/PearlSnare-{level}.wav" for level in _FIVE],
        "BJA": [f"BJA_Pacific/SN_{i:02d}.aiff" for i in range(1, 9)],
        "Millo 2 jazz": [f"Millo_MultiLayered2/jsnare_{i:02d}.flac" for i in range(1, 6)],
        "Millo 2 rock": [f"Millo_MultiLayered2/rsnare_{i:02d}.flac" for i in range(1, 6)],
        "Millo 3": [f"Millo_MultiLayered3/sd_{i:02d}.flac" for i in (1, 2, 3, 4, 5, 6, 8)],
    },
    "bass drum": {
        "Black Pearl": [f"The Black Pearl 1.0/PearlKick-{level}.wav" for level in _FIVE],
        "BJA": [f"BJA_Pacific/BD_{i:02d}.aiff" for i in range(1, 9)],
        "Millo 2": [f"Millo_MultiLayered2/bd_{i:02d}.flac" for i in range(1, 6)],
        "Millo 3": [f"Millo_MultiLayered3/bd_{i:02d}.flac" for i in range(1, 5)],
    },
    "hand drum": {
        **{
            f"Bongo {name}": [f"Gimme A Hand 1.0/Bongo{t}-{level}.wav" for level in _FIVE]
            for name, t in (("high", "Hi"), ("low", "Lo"))
        },
    },
}
Numbers = npt.NDArray[np.float64]


class Measures(NamedTuple):
    """Measures of one drum: bands (strokes, 5) and thirds of an octave (strokes, 27), dB to the whole; flatness of each
    stroke; T60 by octave of the last, s."""

    bands: Numbers
    thirds: Numbers
    flatness: Numbers
    t60_s: Numbers


def trimmed(sound: Numbers) -> Numbers:
    """One channel of a sound (frames, channels), at full level, from just before the blow."""
    mono = sound.mean(axis=1)
    mono = mono / np.abs(mono).max()
    return mono[max(int(np.argmax(np.abs(mono) > 0.02)) - 20, 0) :]


def _spectrum(sound: Numbers, rate_Hz: float) -> tuple[Numbers, Numbers]:
    power = np.abs(np.fft.rfft(sound[: round(1.5 * rate_Hz)], 1 << 17)) ** 2
    f_Hz = np.fft.rfftfreq(1 << 17, 1.0 / rate_Hz)
    power[f_Hz < 30.0] = 0.0
    return power, f_Hz


def _t60_s(sound: Numbers, rate_Hz: float, middle_Hz: float) -> float:
    # From 3 to at most 30 dB below the loudest of an octave, 8 dB above what it ends in; NaN where that is too short.
    from scipy import signal

    filters: Any = signal
    edges = [middle_Hz / math.sqrt(2.0), min(middle_Hz * math.sqrt(2.0), 0.48 * rate_Hz)]
    sections = filters.butter(3, edges, "band", fs=rate_Hz, output="sos")
    around = np.zeros(round(0.25 * rate_Hz))
    heard = filters.sosfiltfilt(sections, np.concatenate([around, sound, around[: len(around) // 2]]))
    heard = heard[len(around) : len(around) + len(sound)] ** 2
    hop = max(round(rate_Hz * max(0.01, 2.0 / middle_Hz)), 1)
    count = len(heard) // hop
    level = 10.0 * np.log10(heard[: count * hop].reshape(count, hop).mean(axis=1) + 1e-30)
    first = int(np.argmax(level))
    end_dB = 10.0 * math.log10(float(np.mean(10.0 ** (level[int(0.9 * count) :] / 10.0))) + 1e-30)
    lowest = max(level[first] - 30.0, end_dB + 8.0)
    last = first
    while last < count and level[last] > lowest:
        last += 1
    begin = first
    while begin < last and level[begin] > level[first] - 3.0:
        begin += 1
    if last - begin < 4:
        return math.nan
    slope = np.polyfit(np.arange(begin, last) * hop / rate_Hz, level[begin:last], 1)[0]
    return -60.0 / float(slope)


def _levels(power: Numbers, f_Hz: Numbers, edges: Iterable[tuple[float, float]]) -> list[float]:
    shares = [power[(f_Hz >= low) & (f_Hz < high)].sum() / power.sum() for low, high in edges]
    return [10.0 * math.log10(share + 1e-12) for share in shares]


def measured(strokes: list[tuple[Numbers, float]]) -> Measures:
    """Measures of a drum, from its strokes (frames, channels) and their rates, the softest first."""
    bands: list[list[float]] = []
    thirds: list[list[float]] = []
    flatness: list[float] = []
    sixth = 2.0 ** (1.0 / 6.0)
    for sound, rate_Hz in strokes:
        power, f_Hz = _spectrum(trimmed(sound), rate_Hz)
        bands.append(_levels(power, f_Hz, itertools.pairwise(EDGES_HZ)))
        thirds.append(_levels(power, f_Hz, ((middle / sixth, middle * sixth) for middle in THIRDS_HZ)))
        middle = power[(f_Hz > 500.0) & (f_Hz < 8000.0)] + 1e-20
        flatness.append(float(np.exp(np.log(middle).mean()) / middle.mean()))
    last, rate_Hz = strokes[-1]
    decays = [_t60_s(trimmed(last), rate_Hz, middle_Hz) for middle_Hz in OCTAVES_HZ]
    return Measures(np.array(bands), np.array(thirds), np.array(flatness), np.array(decays))


def rise(bands: Numbers) -> float:
    """Rise of 1-8 kHz, dB, from the softest stroke to the brightest one."""
    bright = 10.0 * np.log10((10.0 ** (bands[:, 1:4] / 10.0)).sum(axis=1))
    return float(bright.max() - bright[0])


def _at_five(bands: Numbers) -> Numbers:
    places = np.linspace(0.0, len(bands) - 1.0, STROKES)
    columns = [np.interp(places, np.arange(len(bands)), column) for column in bands.T]
    return np.array(columns).T


def distance(one: Numbers, other: Numbers) -> float:
    """Mean difference of band levels over five dynamics, read between the strokes that there are."""
    return float(np.abs(_at_five(one) - _at_five(other)).mean())


def apart_by_band(ours: Numbers, others: list[Numbers]) -> dict[str, Any]:
    """By how many dB a drum's bands differ from others', each over all strokes, the median of the others; and what is
    left of the distance where one number is taken from each, by how much all bands and strokes differ."""
    apart = [_at_five(ours) - _at_five(bands) for bands in others]
    return {
        "held_out_bands_dB": np.median([each.mean(axis=0) for each in apart], axis=0).round(1).tolist(),
        "median_held_out_but_for_level_dB": round(
            float(np.median([np.abs(each - each.mean()).mean() for each in apart])), 1
        ),
    }


def real_from_held_out(kind: str, found: dict[str, dict[str, Measures]]) -> dict[str, float]:
    """Median distance of each recorded drum of a kind from the held-out ones of other kits, dB; none where all are of its own."""

    def kit(group: str, name: str) -> str:
        return {"work": WORK, "held_out": HELD_OUT}[group][kind][name][0].partition("/")[0]

    apart = {
        name: [
            distance(its.bands, other.bands)
            for beside, other in found["held_out"].items()
            if kit("held_out", beside) != kit(group, name)
        ]
        for group, drums in found.items()
        for name, its in drums.items()
        if "off" not in name
    }
    return {name: round(float(np.median(those)), 1) for name, those in apart.items() if those}


def recorded(kits: Path, files: list[str]) -> Measures:
    """Measures of a recorded drum. FileNotFoundError names what is missing."""
    import soundfile

    strokes: list[tuple[Numbers, float]] = []
    for name in files:
        if not (kits / name).is_file():
            raise FileNotFoundError(f"{kits / name} is not there: is {kits} the folder of hydrogen-drumkits?")
        sound, rate_Hz = soundfile.read(kits / name, always_2d=True)
        strokes.append((sound, float(rate_Hz)))
    return measured(strokes)


def speeds_of(scene: Scene) -> list[float]:
    """Speeds of STROKES strokes of the stick, m/s, from the softest to full scale."""
    full = scene.strike.full_scale_m_per_s
    return [float(speed) for speed in np.geomspace(0.1 * full, full, STROKES)]


def played(scene: Scene, place: float = PLACE) -> Measures:
    """Measures of a scene's drum, struck at `place` (share of the radius), from its softest stroke to full scale."""
    strikes = [
        strike_for_speed(scene, speed, place, 0.0, stroke * SECONDS)
        for stroke, speed in enumerate(speeds_of(scene))
    ]
    sound = render(scene, strikes, STROKES * SECONDS, RATE_HZ).astype(np.float64)
    return measured([(stroke, float(RATE_HZ)) for stroke in np.split(sound, STROKES)])


def _told(measures: Measures) -> dict[str, Any]:
    return {
        "softest_dB": [round(float(v), 1) for v in measures.bands[0]],
        "hardest_dB": [round(float(v), 1) for v in measures.bands[-1]],
        "bands_dB": measures.bands.round(1).tolist(),
        "thirds_dB": measures.thirds.round(1).tolist(),
        "rise_dB": round(rise(measures.bands), 1) if len(measures.bands) > 1 else None,
        "flatness": round(float(np.median(measures.flatness)), 3),
        "t60_s": [None if math.isnan(v) else round(float(v), 2) for v in measures.t60_s],
    }


def kept(before: dict[str, Any], anew: Iterable[str]) -> dict[str, str]:
    """Scenes of a stored result that are not measured anew -> when they were, and by which version."""
    machine, earlier = before["machine"], before.get("kept", {})
    when = f"{machine['date']}, version {machine.get('commit') or 'not known'}"
    return {name: earlier.get(name, when) for name in before["scenes"] if name not in set(anew)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kits", type=Path)
    parser.add_argument("--scenes", nargs="+", choices=sorted(KINDS), default=sorted(KINDS))
    parser.add_argument("--held-out", action="store_true")
    args = parser.parse_args()
    groups = {"work": WORK, **({"held_out": HELD_OUT} if args.held_out else {})}
    real = {
        kind: {
            group: {name: recorded(args.kits, files) for name, files in named[kind].items()}
            for group, named in groups.items()
        }
        for kind in sorted({KINDS[name][0] for name in args.scenes} - {""})
    }
    scenes: dict[str, Any] = {}
    for name in args.scenes:
        place = place_of(name)
        ours = played(scene_of(name), place)
        kind, counterpart = KINDS[name]
        beside = {
            group: {other: round(distance(ours.bands, its.bands), 1) for other, its in drums.items()}
            for group, drums in real.get(kind, {}).items()
        }
        medians = {
            f"median_{group}_dB": float(np.median([d for other, d in found.items() if "off" not in other]))
            for group, found in beside.items()
            if found and "off" not in name
        }
        if "median_held_out_dB" in medians:
            medians |= apart_by_band(ours.bands, [its.bands for its in real[kind]["held_out"].values()])
        made = {"made_beside": counterpart, "made_also_beside": ALSO_BESIDE.get(name, "")}
        scenes[name] = {"place": place, **_told(ours), **made, "distance_dB": beside, **medians}
        print(name, json.dumps(scenes[name]), flush=True)
    # What is held out is not shown, so that nobody fits to it.
    recordings = {
        kind: {"work": {name: _told(its) for name, its in found["work"].items()}}
        for kind, found in real.items()
    }
    among = {
        kind: {
            f"{one} / {other}": round(distance(found["work"][one].bands, found["work"][other].bands), 1)
            for one, other in itertools.combinations(found["work"], 2)
        }
        for kind, found in real.items()
    }
    others = {kind: real_from_held_out(kind, found) for kind, found in real.items() if args.held_out}
    older: dict[str, str] = {}
    if set(args.scenes) != set(KINDS):
        before = stored.read("beside_recordings")
        older = kept(before, args.scenes)
        scenes = dict(sorted({**before["scenes"], **scenes}.items()))
        recordings = {**before["recordings"], **recordings}
        among = {**before["among_recordings_dB"], **among}
        others = {**before.get("real_from_held_out_dB", {}), **others}
    result = {
        "edges_Hz": EDGES_HZ,
        "thirds_Hz": [round(middle, 1) for middle in THIRDS_HZ],
        "octaves_Hz": OCTAVES_HZ,
        "scenes": scenes,
        "kept": older,
    }
    result |= {"recordings": recordings, "among_recordings_dB": among, "real_from_held_out_dB": others}
    stored.store("beside_recordings", result)


if __name__ == "__main__":
    main()
