// Haptic drumstick for Bitwig Studio. Made by drumstick lab daw-files; docs/daw/bitwig.md tells how to use it.

loadAPI(10);
host.setShouldFailOnDeprecatedUse(true);
host.defineController("Haptic drumstick", "OSC", "1.0", "3696de80-4542-519f-a71e-059de6616b8e", "Haptic drumstick");
host.defineMidiPorts(1, 0); // a note input needs one; any port will do, none is listened to

var HEAR_PORT = 9101; // where the rig sends to: --osc-out
var RIG_HOST = "127.0.0.1";
var RIG_PORT = 9100; // where the rig hears: --osc-in
var NOTE = 38;
var NOTE_ON = 0x99; // channel 10
var NOTE_OFF = 0x89;

var PARAMETERS = [
    {"name": "dv_pls", "address": "/drumstick/param/dv_pls", "low": 0.0, "high": 1.0, "step": 0.001, "unit": "m/s", "start": 0.2},
    {"name": "k_coll", "address": "/drumstick/param/k_coll", "low": 500.0, "high": 50000.0, "step": 49.5, "unit": "N/m", "start": 5000.0}
];

// What can be mapped, and where its 0..1 lies in the message.
var CONTROLS = [
    {label: "Strike level", address: "/drumstick/level", types: ",f", low: 0, high: 1},
    {label: "Strike x", address: "/drumstick/x", types: ",f", low: -1, high: 1},
    {label: "Strike y", address: "/drumstick/y", types: ",f", low: -1, high: 1},
    {label: "In the head", address: "/drumstick/gate", types: ",i", low: 0, high: 1}
];

var rig; // the way to it
var notes;
var settings = {};
var servo = {}; // what the force loop uses, by parameter; nothing before the first readback

function init() {
    var osc = host.getOscModule();
    notes = host.getMidiInPort(0).createNoteInput("Drumstick", "??????");
    rig = osc.connectToUdpServer(RIG_HOST, RIG_PORT, null);

    var heard = osc.createAddressSpace();
    heard.setName("Haptic drumstick");
    heard.registerMethod("/drumstick/strike", ",ifffff", "a strike", onStrike);
    heard.registerMethod("/drumstick/release", ",iffff", "the stick left the head", onRelease);
    heard.registerMethod("/drumstick/error", ",ss", "something was refused", onError);
    registerControls(heard);
    registerParameters(heard);
    heard.registerDefaultMethod(function () {}); // the rest is not for Bitwig
    osc.createUdpServer(HEAR_PORT, heard);

    host.getDocumentState().getSignalSetting("Panic", "Stick", "No force").addSignalObserver(function () {
        rig.sendMessage("/drumstick/panic");
        rig.sendMessage("/drumstick/panic");
    });
    rig.sendMessage("/drumstick/sync");
}

function registerControls(heard) {
    var bank = host.createUserControls(CONTROLS.length);
    CONTROLS.forEach(function (control, index) {
        var target = bank.getControl(index);
        target.setLabel(control.label);
        heard.registerMethod(control.address, control.types, control.label, function (source, message) {
            var value = control.types === ",i" ? message.getInt(0) : message.getFloat(0);
            target.value().set((value - control.low) / (control.high - control.low));
        });
    });
}

function registerParameters(heard) {
    PARAMETERS.forEach(function (row) {
        var setting = host.getDocumentState().getNumberSetting(
            row.name, "Stick", row.low, row.high, row.step, row.unit, row.start);
        settings[row.name] = setting;
        setting.addRawValueObserver(function (value) {
            // Before the first readback the setting holds the project's old value: the rig must not get that.
            // And a readback that moved the setting needs no answer.
            if (servo[row.name] === undefined || Math.abs(value - servo[row.name]) < row.step) return;
            rig.sendMessage(row.address, value);
        });
        heard.registerMethod(row.address, ",f", row.name, function (source, message) {
            servo[row.name] = message.getFloat(0);
            setting.setRaw(Math.min(Math.max(servo[row.name], row.low), row.high));
        });
    });
}

function onStrike(source, message) {
    var velocity = 1 + Math.round(126 * message.getFloat(4));
    notes.sendRawMidiEvent(NOTE_ON, NOTE, velocity);
}

function onRelease() {
    notes.sendRawMidiEvent(NOTE_OFF, NOTE, 0);
}

function onError(source, message) {
    host.showPopupNotification("Drumstick: " + message.getString(0) + ": " + message.getString(1));
}

function flush() {}

function exit() {
    notes.sendRawMidiEvent(NOTE_OFF, NOTE, 0);
}
