"""How the page looks: the colours and letters of the pictures, on light and dark ground."""

from typing import Any

from barberpole.figures.theme import BLUE, DARK_GROUND, FONT, GREEN, LIGHT_GROUND, VERMILLION, Ground


def _variables(ground: Ground, accent: str, good: str, bad: str) -> str:
    return (
        f"--paper:{ground.paper};--ink:{ground.ink};--quiet:{ground.quiet};--grid:{ground.grid};"
        f"--raised:{ground.raised};--accent:{accent};--good:{good};--bad:{bad};"
    )


ACCENT = {False: BLUE, True: "#6cb6e8"}  # by whether the ground is dark

# on dark ground the hues are lightened until letters in them keep 4.5:1
CSS = f"""
:root {{ {_variables(LIGHT_GROUND, ACCENT[False], "#00704f", "#b34700")} --bar:{VERMILLION}; --floor:{GREEN}; }}
body.body--dark {{ {_variables(DARK_GROUND, ACCENT[True], "#3fc79a", "#f0934e")} }}
body {{ font-family:{FONT}; background:var(--paper); color:var(--ink); font-size:14px; line-height:1.4; }}
"""

RULES = """
.nicegui-content { padding:0; gap:0; align-items:stretch; }
.q-layout, .q-page-container { background:var(--paper); }
:focus-visible { outline:2px solid var(--accent); outline-offset:2px; border-radius:3px; }
.bp-head { display:flex; align-items:center; gap:10px; height:52px; padding:0 16px; border-bottom:1px solid var(--grid);
  position:sticky; top:0; background:var(--paper); z-index:20; }
.bp-word { font-weight:650; font-size:16px; letter-spacing:-.01em; white-space:nowrap; }
.bp-word b { color:var(--accent); font-weight:650; }
.bp-log { color:var(--quiet); white-space:nowrap; overflow:hidden; text-overflow:ellipsis; min-width:0; flex:1; }
.bp-verdict { display:grid; grid-template-columns:minmax(0,1fr) minmax(340px,38%); gap:28px; align-items:center;
  padding:12px 16px; height:104px; border-bottom:1px solid var(--grid); }
.bp-said { font-size:21px; font-weight:600; letter-spacing:-.01em; line-height:1.2; }
.bp-next { color:var(--quiet); max-height:40px; overflow:hidden; display:-webkit-box; -webkit-line-clamp:2;
  -webkit-box-orient:vertical; }
.bp-main { display:grid; grid-template-columns:252px minmax(0,1fr) 348px; align-items:start; }
.bp-side { padding:14px 16px; position:sticky; top:52px; max-height:calc(100vh - 52px); overflow-y:auto; }
.bp-mid { border-left:1px solid var(--grid); border-right:1px solid var(--grid); min-height:calc(100vh - 156px); }
.bp-h { font-size:12.5px; line-height:1.35; font-weight:650; color:var(--quiet); margin:0 0 6px; letter-spacing:.01em; }
.bp-fig { padding:12px 16px 10px; border-bottom:1px solid var(--grid); }
.bp-fig h3 { font-size:15px; font-weight:600; margin:0; min-height:21px; line-height:1.35; }
.bp-fig p { font-size:12.5px; color:var(--quiet); margin:2px 0 0; min-height:35px; }
.bp-row { display:flex; align-items:center; gap:8px; min-height:26px; }
.bp-eff { flex:1; min-width:0; overflow:hidden; text-overflow:ellipsis; white-space:nowrap; }
.bp-off { color:var(--quiet); }
.bp-stack .q-toggle { margin:-6px 0; }
.bp-stack .q-toggle__inner { font-size:30px; }
.bp-card { border:1px solid var(--grid); border-radius:8px; padding:10px 12px; margin-bottom:8px; }
.bp-card.named { border-color:var(--accent); background:color-mix(in srgb, var(--accent) 7%, var(--paper)); }
.bp-card .name { font-weight:620; font-size:15px; }
.bp-eq { font-family:"Latin Modern Math","STIX Two Math",Cambria,"DejaVu Serif",serif; font-size:14px; margin:3px 0;
  line-height:1.3; overflow-wrap:anywhere; }
.bp-small { font-size:12.5px; color:var(--quiet); }
.bp-meter { height:5px; border-radius:3px; background:var(--grid); overflow:hidden; margin:6px 0 4px; }
.bp-meter i { display:block; height:100%; background:var(--accent); }
.bp-fall { position:relative; height:26px; border-radius:5px; background:var(--raised); overflow:hidden; }
.bp-fall i { position:absolute; left:0; top:0; bottom:0; background:var(--bar); border-radius:5px 0 0 5px;
  transition:width .45s cubic-bezier(.2,.7,.2,1), background-color .3s; }
.bp-fall.floor i { background:var(--floor); }
.bp-fall u { position:absolute; top:0; bottom:0; width:0; border-left:2px dashed var(--ink); transition:left .45s; }
.bp-figure { display:flex; justify-content:space-between; font-size:13px; margin-top:4px;
  font-variant-numeric:tabular-nums; }
.bp-pattern { display:block; width:100%; text-align:left; border:0; background:none; color:var(--quiet); padding:3px 0;
  cursor:pointer; font-size:12.5px; line-height:1.35; }
.bp-pattern:hover { color:var(--accent); }
.bp-blind { border-top:1px solid var(--grid); padding:7px 0 8px; font-size:12.5px; color:var(--quiet); }
.bp-names { display:flex; flex-wrap:wrap; gap:4px; margin-top:4px; }
.bp-name { background:var(--raised); color:var(--ink); border-radius:5px; padding:0 6px; }
.bp-next-step { font-size:13.5px; border-left:3px solid var(--accent); padding-left:10px; margin:0; }
.bp-chips { display:flex; flex-wrap:wrap; gap:4px; margin:6px 0 2px; }
.bp-chip { border:1px solid var(--grid); border-radius:12px; padding:1px 9px; font-size:12.5px; background:none;
  color:var(--ink); cursor:pointer; }
.bp-chip.follows { border-color:var(--accent); color:var(--accent); }
.bp-chip:hover { border-color:var(--accent); }
.bp-chip[aria-pressed=true] { background:var(--accent); color:var(--paper); border-color:var(--accent); }
.bp-step { display:flex; align-items:baseline; gap:6px; width:100%; text-align:left; padding:3px 6px; border-radius:5px;
  background:none; border:0; color:var(--ink); cursor:pointer; font-size:13.5px; }
.bp-step:hover { background:var(--raised); }
.bp-step[aria-current=step] { background:var(--raised); font-weight:620; }
.bp-step.off { color:var(--quiet); }
.bp-step span:last-child { margin-left:auto; font-variant-numeric:tabular-nums; }
.bp-live { display:grid; grid-template-columns:minmax(0,1fr) 400px; align-items:start; }
.bp-live > section { border-right:1px solid var(--grid); }
.bp-title { font-size:18px; font-weight:640; margin:0; line-height:1.3; }
.bp-busy { position:fixed; left:0; right:0; bottom:0; height:34px; display:flex; align-items:center; gap:10px;
  padding:0 16px; background:var(--raised); border-top:1px solid var(--grid); font-size:13px; z-index:30; }
.bp-brush { display:flex; align-items:center; gap:8px; height:34px; font-size:13px; }
.bp-start { max-width:920px; margin:0 auto; padding:40px 20px 60px; width:100%; }
.bp-start h1 { font-size:28px; font-weight:650; letter-spacing:-.02em; margin:0 0 6px; line-height:1.15; }
.bp-start h2 { font-size:16px; font-weight:620; margin:26px 0 8px; line-height:1.3; }
.bp-levels { display:grid; grid-template-columns:repeat(auto-fill,minmax(165px,1fr)); gap:10px; }
.bp-level { display:flex; flex-direction:column; text-align:left;
  border:1px solid var(--grid); border-radius:8px; padding:12px; background:none;
  color:var(--ink); cursor:pointer; }
.bp-level:hover { border-color:var(--accent); }
.bp-level b { display:block; font-size:15px; }
.bp-drop .q-uploader { width:100%; max-height:none; background:var(--raised); border:1.5px dashed var(--quiet);
  border-radius:10px; box-shadow:none; color:var(--ink); }
.bp-drop .q-uploader__header { background:none; color:var(--ink); }
.bp-drop .q-uploader__list { min-height:34px; padding:0; }
.bp-drop .q-uploader__subtitle { display:none; }
.bp-tab { border:0; background:none; color:var(--quiet); padding:6px 4px; cursor:pointer; font-size:14px;
  border-bottom:2px solid transparent; }
.bp-tab[aria-selected=true] { color:var(--ink); border-color:var(--accent); font-weight:600; }
.q-btn { text-transform:none; letter-spacing:0; }
.q-dialog__inner > .q-card, .q-menu { background:var(--paper); color:var(--ink); }
.bp-error { color:var(--bad); white-space:pre-wrap; min-height:40px; font-size:13.5px; }
.bp-wrong { background:color-mix(in srgb, var(--bad) 22%, transparent); }
.bp-par { font-size:12.5px; width:100%; border-collapse:collapse; font-variant-numeric:tabular-nums; }
.bp-par td, .bp-par th { padding:2px 6px 2px 0; text-align:right; font-weight:400;
  border-bottom:1px solid var(--grid); }
.bp-par td:first-child, .bp-par th:first-child { text-align:left; }
.js-plotly-plot { width:100%; }
@media (max-width:1180px) { .bp-main { grid-template-columns:220px minmax(0,1fr) 300px; } }
@media (max-width:900px) {
  .bp-main, .bp-live, .bp-verdict { grid-template-columns:minmax(0,1fr); }
  .bp-verdict { height:auto; gap:12px; }
  .bp-head { height:auto; min-height:52px; flex-wrap:wrap; padding:4px 16px; position:static; }
  .bp-side { position:static; max-height:none; }
  .bp-mid { border-left:0; border-right:0; border-top:1px solid var(--grid); min-height:0; order:2; }
  nav.bp-side { order:3; }
  .bp-live > section { border-right:0; }
}
@media (prefers-reduced-motion:reduce) { .bp-fall i, .bp-fall u { transition:none; } }
"""


def blank(height: int) -> dict[str, Any]:
    """The layout of a picture that is not drawn yet: nothing, on either ground."""
    clear = "rgba(0,0,0,0)"
    grounds, axes = {"paper_bgcolor": clear, "plot_bgcolor": clear}, {"xaxis": {"visible": False}}
    return {"height": height, "autosize": True, **grounds, **axes, "yaxis": {"visible": False}}
