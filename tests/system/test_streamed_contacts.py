"""Ten thousand contacts of `paper-roll`, streamed on loopback by real processes: not one has a gap."""

import msgspec
import numpy as np
import pytest

from drumstick.scenes.scene_text import shipped_text
from drumstick_lab.benchmarks.network.streamed_wire import CONTACTS, Heard, beside_stalls, broken, played
from drumstick_lab.soak.quicker import quicker
from protocol.messages import Contact, Release

PATIENCE_S = 300.0


@pytest.mark.long
@pytest.mark.timeout(600)
def test_ten_thousand_contacts_come_without_a_gap() -> None:
    # Four times as often, or it would take six minutes; heard late enough for a busy machine.
    text = quicker(shipped_text("paper-roll"), "paper-roll", 4.0)
    found = played(text.replace("[drum]", "[drum]\nlatency_s = 0.5"), CONTACTS, PATIENCE_S)
    assert found["contacts"] >= CONTACTS
    assert found["broken"] == 0
    assert found["broken_beside_stalls"] <= CONTACTS // 100  # the host's own, seen by threads that only sleep
    # The newest meter is from a tenth of a second ago. What a machine that is too busy for half a second makes late, it
    # counts: nothing is lost unsaid.
    assert found["sounded"] + found["late"] >= CONTACTS - 100


def _told(count: int) -> tuple[list[Heard], list[Release]]:
    heard: list[Heard] = []
    releases: list[Release] = []
    for seq in range(1, count + 1):
        for first, forces in ((10 * seq, [1.0, 2.0]), (10 * seq + 2, [0.5, 0.0])):
            packed = np.array(forces, "<f4").tobytes()
            piece = Contact(boot=1, seq=seq, first_tick=first, rate_Hz=1000.0, forces=packed)
            heard.append(Heard(piece, 0))
        releases.append(
            Release(
                boot=1,
                seq=seq,
                t_ns=0,
                exit_speed_m_per_s=1.0,
                impulse_N_s=3.5e-3,
                peak_N=2.0,
                contact_s=3e-3,
            )
        )
    return heard, releases


def test_what_is_whole_is_found_whole_and_each_kind_of_gap_is_found() -> None:
    heard, releases = _told(5)
    assert broken(heard, releases) == (3, [])
    assert broken(heard[:4] + heard[5:], releases) == (3, [3]), "its beginning is lost"
    assert broken(heard[:5] + heard[6:], releases) == (3, [3]), "its end is lost"
    assert broken(heard[:4] + heard[6:], releases) == (3, [3]), "all of it"
    assert broken(heard, releases[:2] + releases[3:]) == (3, [3]), "its release"
    assert broken([*heard, heard[5]], releases) == (3, [3]), "a piece came twice"
    weak = msgspec.structs.replace(heard[4].contact, forces=np.array([1.0, 1.9], "<f4").tobytes())
    assert broken([*heard[:4], Heard(weak, 0), *heard[5:]], releases) == (3, [3]), "another force"


def test_only_a_stall_of_the_machine_excuses_a_broken_contact() -> None:
    _, releases = _told(6)
    ends = [1_000_000_000 * seq for seq in range(1, 7)]
    releases = [msgspec.structs.replace(r, t_ns=t) for r, t in zip(releases, ends, strict=True)]
    at_3, short = (2_990_000_000, 3_005_000_000), (4_999_500_000, 5_000_500_000)
    assert beside_stalls([2, 3, 5], releases, np.array([at_3, short])) == [3]
    assert beside_stalls([2, 3, 5], releases, np.zeros((0, 2), np.int64)) == []
    del releases[2]  # its release was lost too: the next one's time stands for it
    assert beside_stalls([3], releases, np.array([(3_950_000_000, 3_960_000_000)])) == [3]
