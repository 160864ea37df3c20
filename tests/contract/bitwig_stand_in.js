// A stand-in for Bitwig Studio: it loads a controller script, plays what stdin says, and prints every call of the script.
// Its names are those of Bitwig's controller API 10; anything else that the script calls fails, as it would there.
const fs = require("fs");
const vm = require("vm");

const calls = [];
const methods = {};
const observers = {};
let signal;

function record(what, ...more) {
    calls.push([what, ...more]);
}

function setting(label, row) {
    return {
        addRawValueObserver: (callback) => {
            observers[label] = callback;
            callback(row.start); // Bitwig tells the present value at once
        },
        setRaw: (value) => {
            record("setting", label, value);
            observers[label](value);
        },
    };
}

const documentState = {
    getNumberSetting: (label, category, low, high, step, unit, start) => {
        record("number", label, category, low, high, step, unit, start);
        return setting(label, {start});
    },
    getSignalSetting: (label, category, action) => ({addSignalObserver: (callback) => (signal = callback)}),
};

const host = {
    setShouldFailOnDeprecatedUse: () => {},
    defineController: (vendor, name, version, uuid, author) => record("define", uuid),
    defineMidiPorts: (ins, outs) => record("ports", ins, outs),
    getMidiInPort: () => ({
        createNoteInput: (name, mask) => ({sendRawMidiEvent: (...bytes) => record("midi", ...bytes)}),
    }),
    getOscModule: () => ({
        createAddressSpace: () => ({
            setName: () => {},
            registerMethod: (address, types, words, callback) => (methods[address] = {types, callback}),
            registerDefaultMethod: () => {},
        }),
        createUdpServer: (port) => record("hears", port),
        connectToUdpServer: (to, port) => {
            record("connects", to, port);
            return {sendMessage: (address, ...args) => record("osc", address, ...args)};
        },
    }),
    createUserControls: (count) => ({
        getControl: (index) => ({
            setLabel: () => {},
            value: () => ({set: (value) => record("control", index, value)}),
        }),
    }),
    getDocumentState: () => documentState,
    showPopupNotification: (text) => record("popup", text),
};

function message(args) {
    return {getInt: (at) => args[at], getFloat: (at) => args[at], getString: (at) => args[at]};
}

const context = vm.createContext({host, loadAPI: (version) => record("api", version)});
vm.runInContext(fs.readFileSync(process.argv[2], "utf8"), context, {filename: process.argv[2]});
context.init();
for (const [what, ...rest] of JSON.parse(fs.readFileSync(0, "utf8"))) {
    record("step", what, ...rest);
    if (what === "signal") signal();
    else if (what === "observer") observers[rest[0]](rest[1]);
    else if (what === "exit") context.exit();
    else methods[what].callback(null, message(rest));
}
const types = Object.fromEntries(Object.entries(methods).map(([address, row]) => [address, row.types]));
process.stdout.write(JSON.stringify({calls, types}));
