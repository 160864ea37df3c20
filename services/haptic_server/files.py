"""Names of the files in the run folder of a rig's haptic machine."""

BLOCK = "servo.block"  # shared by servo and gateway; the servo makes it
SCENE = "scene.toml"  # the text that both processes read; whoever starts them puts it there
WANTED = (
    "scene.wanted"  # a scene's name, or its number in the set list; the gateway makes it, who started us acts
)
NEXT = "next"  # folder of the scene that is made ready while another plays; who started us makes it
SERVO_READY, GATEWAY_READY = "servo.ready", "gateway.ready"  # in it, made by those that wait for their turn
REFUSED = "scene.refused"  # why a scene was not played; who started us makes it, the gateway tells it
SET_LIST = "set-list.json"  # the scenes of `--set-list` and which of them plays; who started us makes it
LIMITS = "limits.json"  # what scene and device allow; the servo makes it before its block
GESTURE = "gesture.csv"  # the scene's recorded gesture, if it has one; put there with the scene
TRACE = "trace.csv"  # the last thousand ticks before the last fault
GRANTED = "servo.json"  # what the servo asked of the operating system, and got
LISTENERS_AWAITED = (
    "listeners.awaited"  # while it is there, a servo that is ready waits a little with its first tick
)
CONTACTS = "contacts.ring"  # the force of contacts, where the scene streams it; the servo makes it

MAX_SCENE_BYTES = 200_000  # as much as `drumstick` lays out
