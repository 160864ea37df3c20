"""Names of the parts of a rig, as commands and units have them. Any thread."""

HAPTIC, SOUND, PANEL = "haptic", "sound", "panel"
RECORD, ACCESS = "record", "door"  # the unit of the public listener is called door
NOT_ESSENTIAL = frozenset({RECORD})  # whose end never ends a rig
