"""Style sheet of the page: large on dark. Everything is inside the page; nothing is fetched.

viser draws its own controls small, for a desk. The technician stands at the mixing desk, three metres away.
"""

MARK_PANIC = '<div class="dr-panic"></div>'

PHONE = "(max-width:36em)"  # where viser, too, lays a page out for a phone
TABLET = "(max-width:50em)"  # there is no room for the picture beside the controls
WIDE = "(min-width:1500px)"  # plots beside controls and picture

CSS = """
.dr:has(.dr-notice){padding-top:.3em;padding-bottom:.6em}
.dr{font-variant-numeric:tabular-nums;padding:0 .75em;line-height:1.3;color:#e8eaed}
.dr-notice{border-radius:.5em;padding:.4em .8em;border-left:.45em solid;height:6.8em;box-sizing:border-box;
 overflow-y:auto}
.dr-notice b{display:block;font-size:1.75em;line-height:1.15;font-weight:650}
.dr-notice span{display:block;font-size:1em;color:#c9ced6}
.dr-notice .dr-alarm{color:#ff9b9b}
.dr-wait{background:#2b2a20;border-color:#e0b53c}.dr-wait b{color:#f4d47a}
.dr-good{background:#1b2a20;border-color:#3fb764}.dr-good b{color:#7fe3a0}
.dr-busy{background:#182a35;border-color:#38a3e0}.dr-busy b{color:#86cdf7}
.dr-bad{background:#3a1a1c;border-color:#f04a4a}.dr-bad b{color:#ff9b9b}
.dr-tiles{display:grid;grid-template-columns:repeat(3,1fr);gap:.5em;margin:.3em 0 .4em}
.dr-tile{background:#202226;border-radius:.5em;padding:.4em .6em .45em;min-width:0}
.dr-tile i{font-style:normal;display:block;font-size:.9em;color:#a9b0ba;white-space:nowrap}
.dr-tile sub{line-height:0}
.dr-tile b{font-size:3em;line-height:1.05;font-weight:650;white-space:nowrap;letter-spacing:-.02em}
.dr-tile u{text-decoration:none;font-size:1.05em;color:#a9b0ba;margin-left:.25em}
.dr-share{display:flex;align-items:center;gap:.5em;font-size:.9em;color:#a9b0ba;height:1.1em}
.dr-level{flex-grow:1;height:.45em;border-radius:.2em;background:#33363c;overflow:hidden}
.dr-level div{height:100%;background:linear-gradient(90deg,#38a3e0,#f2b63d)}
.dr-old b,.dr-old .dr-level,.dr-old .dr-val,.dr-old circle{opacity:.5}
.dr-small{font-size:.92em;color:#a9b0ba;margin:.1em 0 .3em}
/* room for the longest words that are usual, so that what a hand reaches for stands still; longer ones scroll */
.dr-room{height:calc(var(--lines)*1.3em + .2em);overflow-y:auto}
.dr-small b{color:#e8eaed;font-weight:600}
[data-part="exact-title"]{margin-top:.8em}
[data-part="steps"]{margin-top:.5em}
.dr-alarm,.dr-small .dr-alarm{color:#ff9b9b}
.dr-c{padding:.5em .75em 0;font-variant-numeric:tabular-nums}
.dr-row{display:flex;align-items:baseline;justify-content:space-between;gap:.6em;line-height:1.15}
.dr-name{font-size:1.15em;color:#fff;font-weight:600}
.dr-name sub{font-size:.65em}
.dr-val{white-space:nowrap;font-size:1.3em;font-weight:650;color:#fff}
.dr-val u{text-decoration:none;font-size:.6em;color:#a9b0ba;margin-left:.3em;font-weight:400}
.dr-big .dr-name{font-size:2em}
.dr-big .dr-val{font-size:3em;line-height:1}
.dr-big .dr-val u{font-size:.42em}
.dr-note{font-size:.95em;color:#a9b0ba;line-height:1.3;height:2.6em;overflow-y:auto}
.dr-note.dr-waits{color:#f4d47a}
.dr-note.dr-refused{color:#ff9b9b;font-weight:500}
.dr-row s{text-decoration:none;color:#f4d47a;font-size:1.15em;font-weight:600;margin-left:auto;white-space:nowrap}
.dr-big .dr-row s{font-size:1.5em}
.dr-fore{display:flex;flex-wrap:wrap;align-items:baseline;gap:.1em .9em;color:#c9ced6;font-size:1em}
.dr-fore i,.dr-fore u{font-style:normal;text-decoration:none;font-size:.92em;color:#a9b0ba}
.dr-fore b{font-size:1.35em;font-weight:650;color:#86cdf7}
.dr-fore sub{line-height:0}
.dr-fore .dr-alarm{flex-basis:100%}
.dr-out b{color:#ff9b9b}
.dr-reach{width:100%;max-height:13em;display:block}
.dr-reach path{stroke:#33363c;stroke-width:1}
.dr-reach polygon{fill:#38a3e0;fill-opacity:.35;stroke:#86cdf7;stroke-width:1.5}
.dr-reach circle{fill:#f2b63d}
.dr-reach text{fill:#a9b0ba;font-size:9px}

.dr-pad{position:relative;height:11em;margin:.2em 0 .5em;border-radius:.6em;border:2px solid #38a3e0;cursor:crosshair;
 background:linear-gradient(#202a33 0%,#23282e 55%,#3a3226 100%);display:flex;flex-direction:column;
 justify-content:space-between;align-items:center;padding:.35em .6em;touch-action:none;user-select:none;
 -webkit-user-select:none;-webkit-touch-callout:none;overflow:hidden}
.dr-pad:focus-visible{outline:3px solid #f2b63d;outline-offset:2px}
.dr-pad span{font-size:.9em;color:#c9ced6;text-align:center;pointer-events:none}
.dr-pad b{position:absolute;width:1.5em;height:1.5em;margin:-.75em 0 0 -.75em;border-radius:50%;pointer-events:none;
 background:#f2b63d;opacity:.35;left:50%;top:0}
.dr-pad[data-held] b{opacity:1}
.dr-play{display:flex;align-items:center;gap:.8em;margin:.4em 0 .5em}
.dr-play span{font-size:.95em;color:#c9ced6}
.dr-head{position:relative;flex:none;width:10em;height:10em;border-radius:50%;border:3px solid #96989e;
 background:#d6cdb8;cursor:crosshair;touch-action:none;user-select:none;-webkit-user-select:none;
 -webkit-touch-callout:none}
.dr-head:focus-visible{outline:3px solid #f2b63d;outline-offset:2px}
.dr-head b{position:absolute;width:1.2em;height:1.2em;margin:-.6em 0 0 -.6em;border-radius:50%;pointer-events:none;
 background:#b0362c;opacity:.55}

/* viser's own parts: larger handles; no number box beside a slider, since it sends every keystroke (5, 50, 500 ...)
   and cannot show a logarithmic slider's value: exact values have their own entry with a button; no label beside it,
   since the name stands above; no notices of viser's about the browser's graphics, since the picture is a nicety */
.mantine-Slider-root + .mantine-NumberInput-root{display:none}
.mantine-Slider-root{padding-top:.6rem !important;padding-bottom:1.4rem !important;margin:0 1.1rem 0 .75rem}
.mantine-Slider-track{height:.65rem}
/* what a slider cannot reach is barred, over its track and below its thumb */
.mantine-Slider-track::after{content:"";position:absolute;inset:0;z-index:2;pointer-events:none;
 --bars:repeating-linear-gradient(135deg,#1b1c1f 0 5px,#b0605a 5px 7px);
 background:var(--bars) left/var(--below,0%) 100% no-repeat,var(--bars) right/var(--above,0%) 100% no-repeat}
.mantine-Slider-thumb{width:1.3rem !important;height:1.7rem !important;border-radius:.3rem}
.mantine-Slider-mark{transform:none !important;width:3px !important;height:.65rem !important;border:0 !important}
.mantine-Slider-markLabel{font-size:.85rem !important;color:#a9b0ba;margin-top:.3rem !important;white-space:nowrap}
.mantine-Flex-root:has(.mantine-Slider-root) > div:has(> .mantine-Text-root > label)
{position:absolute;width:1px !important;height:1px;overflow:hidden;clip-path:inset(50%)}
.mantine-Slider-label,.mantine-Notifications-root{display:none}
/* PANIC stays in sight however far one scrolls; what viser hides there must clip, for a box that hides also scrolls */
div:has(> div > div > div > .dr-panic){overflow:clip !important;min-width:0}
.mantine-ScrollArea-root:has(.dr-panic){overflow:clip;min-height:0}
/* the space above it is its own, so that it rests where it sticks, and that beside it, where nothing may show while one
   scrolls; what the keyboard reaches stops below it */
div:has(> .dr-panic) + div{--above:0px;--beside:var(--mantine-spacing-xs);position:sticky;top:0;z-index:20;
 background:var(--mantine-color-body);--room:calc(var(--mantine-spacing-xs) + var(--above));
 margin:calc(-1*var(--room)) 0 0 !important;padding:var(--room) var(--beside) 0}
/* what opens over the page, tooltips and lists too, has a hole where PANIC is; the palette of commands and an enlarged
   plot open below it. The page's script says where */
[data-portal]{position:fixed;top:0;left:0;z-index:100;clip-path:polygon(evenodd,0 0,100vw 0,100vw 100vh,0 100vh,0 0,
 var(--panic-left) var(--panic-top),var(--panic-left) var(--panic-bottom),var(--panic-right) var(--panic-bottom),
 var(--panic-right) var(--panic-top),var(--panic-left) var(--panic-top))}
.mantine-Spotlight-root,.mantine-Modal-root{--modal-y-offset:calc(var(--panic-bottom) + 1rem) !important}
.mantine-Spotlight-content,.mantine-Modal-content{
 max-height:calc(100dvh - var(--panic-bottom) - 2rem) !important}
.mantine-ScrollArea-viewport:has(.dr-panic){scroll-padding-top:5.2rem}
div:has(> .dr-panic) + div .mantine-Button-root{height:3.6rem !important;background:#e01f1f !important;
 transform:none !important}
div:has(> .dr-panic) + div .mantine-Button-root:hover{background:#ff3b3b !important}
div:has(> .dr-panic) + div .mantine-Button-label{font-size:1.9rem;font-weight:800 !important;
 letter-spacing:.12em;color:#fff}
.dr-qr{display:block;width:min(100% - 1.5em,20em);margin:0 .75em .5em}
.dr-table{border-collapse:collapse;width:100%;font-size:1em;color:#e8eaed;margin:.2em 0 .4em}
.dr-table th{text-align:right;font-weight:400;color:#a9b0ba;padding:.15em .3em;border-bottom:1px solid #33363c}
.dr-table td{text-align:right;padding:.2em .3em;white-space:nowrap}
.dr-table th:first-child,.dr-table td:first-child{text-align:left;white-space:normal}
[data-part="view"] .dr-small{font-size:1.15em;color:#e8eaed;margin-top:.4em}
/* all that is pressed: 44 px for a finger. What is drawn smaller, heads of folders and thumbs of sliders, is felt
   beyond its edge; viser sizes by rem, which is smaller on a phone */
.mantine-Button-root[data-size="compact-xs"]{font-size:1rem;padding:0 1rem}
.mantine-Button-root[data-size="compact-xs"] .mantine-Button-inner{min-width:30px}
.mantine-Button-root,.mantine-ActionIcon-root{min-height:44px;min-width:44px}
div:has(> div > div > button .tabler-icon-list-search){min-height:46px}
.mantine-TextInput-input{height:44px !important;font-size:1rem}
.mantine-Spotlight-action,.mantine-Select-option{min-height:44px}
.mantine-Slider-thumb::before{content:"";position:absolute;left:50%;top:50%;width:44px;height:44px;
 transform:translate(-50%,-50%)}
.mantine-Paper-root[aria-expanded]::after{content:"";position:absolute;left:-6px;right:-6px;top:50%;height:44px;
 transform:translateY(-50%)}
div:has(> .mantine-Paper-root[aria-expanded]){margin-bottom:25px !important}
div:has(> .dr-room-mark) + div{display:none}
.dr-unseen{position:absolute;width:1px;height:1px;margin:0;overflow:hidden;clip-path:inset(50%)}
.mantine-Text-root > label{color:#c9ced6}
/* what is chosen: a tick and a frame besides the colour; in the button's margin, so that no button grows by it */
.mantine-Button-root[aria-pressed="true"]{background:#1f6f9f !important;color:#fff;box-shadow:inset 0 0 0 2px #fff}
.mantine-Button-root[aria-pressed="true"]::after{content:"✓";content:"✓" / "";position:absolute;left:.2em;top:50%;
 transform:translateY(-50%);font-size:.8em}
:focus-visible,.mantine-Slider-thumb:focus-visible{outline:3px solid #f2b63d !important;outline-offset:2px}
@media (hover:hover){div:has(> .dr-panic) + div .mantine-Button-label::after{content:"Esc";font-size:.9rem;
 font-weight:500;letter-spacing:0;border:1px solid;border-radius:.25rem;padding:.05rem .35rem;margin-left:.8rem}}
.uplot{font-family:inherit}
.u-legend{font-size:.9em;color:#c9ced6}
/* viser draws it up into the plot, over the name of the axis */
.uplot .u-legend{margin-top:-.3em}
/* room for the values at the cursor, so that the plot below stands still */
.u-legend .u-value{display:inline-block;min-width:4.5em;text-align:left}
/* its own ground, not the gradient that viser draws its dock's line with: so that its contrast is decided */
[data-dock-tab] > span{background:var(--mantine-color-body)}
/* out of view, viser does not draw the picture */
@media TABLET{
 div:has(> div > div > canvas[data-engine]){transform:translateX(-200vw);width:1px !important;height:1px !important}
}
@media PHONE{
 div[style*="position: fixed"][style*="width: 20em"]{width:100% !important;height:94% !important;
  max-height:94% !important}
 div[style*="position: fixed"] div[style*="width: 20em"]{width:100% !important}
 /* viser's head would scroll away, and PANIC move up by it; and a tap on it would fold the page, and PANIC with it */
 div[style*="width: 20em"] > div:has(> button .tabler-icon-list-search){position:sticky !important;top:0;z-index:21;
  height:48px !important;background:var(--mantine-color-body);pointer-events:none}
 div[style*="width: 20em"] > div > button{pointer-events:auto}
 /* some pixels of it lie behind the head, so that nothing shows between the two */
 div:has(> .dr-panic) + div{--above:5px;top:44px}
 .mantine-ScrollArea-viewport:has(.dr-panic){scroll-padding-top:calc(49px + 5.2rem)}
 .dr-notice{height:8.6em}
 .dr-note{height:3.9em}
 .dr-room{height:calc((var(--lines) + 1)*1.3em + .2em)}
 .dr-tile{padding:.35em .45em}
 .dr-tile b{font-size:2.1em}
 .dr-tile i{font-size:.8em}
 .dr-tile u{font-size:.85em;margin-left:.15em}
 .dr-notice b{font-size:1.3em}
 .dr-notice span{font-size:.92em}
 .dr-big .dr-name{font-size:1.6em}
 .dr-big .dr-val{font-size:2.3em}
}
""".replace("TABLET", TABLET).replace("PHONE", PHONE)
