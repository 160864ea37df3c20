"""Watchdog messages to the supervisor while the loop ticks. Main thread; the loop knows nothing of it."""

from haptic_server.records import FAULT, FAULT_WORDS, STATUS_WORDS
from haptic_server.servo.force.memory import Servo
from realtime.notify import Supervisor


class Watchdog:
    """Feeds the watchdog only while the tick counter advances: the main thread may live though the loop hangs."""

    def __init__(self, servo: Servo, supervisor: Supervisor) -> None:
        self._status = servo.status
        self._supervisor = supervisor
        self._seen = 0
        self._reported_still = False

    def poll(self) -> None:
        """Several times within the watchdog's time."""
        tick = int(self._status[0]["tick"])
        if tick != self._seen:
            self._seen = tick
            self._reported_still = False
            if self._supervisor.is_due:
                self._supervisor.notify_alive(self._words())
        elif tick and not self._reported_still:
            self._reported_still = True
            self._supervisor.notify_trouble(f"the force loop has not ticked since tick {tick}")

    def _words(self) -> str:
        status = self._status[0]
        code = int(status["status"])
        words = (
            f"fault: {FAULT_WORDS.get(int(status['fault']), 'unknown')}"
            if code == FAULT
            else STATUS_WORDS[code]
        )
        late_ms = int(status["lateness_worst_ns"]) / 1e6
        return (
            f"{words}; {int(status['strikes'])} strikes, {int(status['tick'])} ticks,"
            f" {int(status['overruns'])} missed, worst {late_ms:.2f} ms late"
        )
