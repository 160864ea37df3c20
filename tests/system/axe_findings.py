"""Findings of axe on a page, with the contrasts decided that axe leaves open because of a pseudo-element."""

from typing import Any, NamedTuple

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

# axe decides no contrast below an ancestor that has a pseudo-element of some size, wherever it is drawn. The marks of a
# slider lie below its track, whose ground is one: nodes that lie wholly outside the ancestor's box are decided without
# it. Boxes of the two, by axe's own selectors.
_APART = """pairs => pairs.map(([node, ancestor]) => {
  const a = document.querySelector(node).getBoundingClientRect();
  const b = document.querySelector(ancestor).getBoundingClientRect();
  return a.top >= b.bottom || a.bottom <= b.top || a.left >= b.right || a.right <= b.left;
})"""
_DECIDED = """async nodes => {
  const options = {  // axe's own of this rule, but for the first
    ignorePseudo: true, ignoreUnicode: true, ignoreLength: false, boldValue: 700, boldTextPt: 14, largeTextPt: 18,
    contrastRatio: {normal: {expected: 4.5}, large: {expected: 3}}, pseudoSizeThreshold: 0.25,
    shadowOutlineEmMax: 0.2, textStrokeEmMin: 0.03,
  };
  axe.configure({checks: [{id: "color-contrast", options}]});
  return axe.run({include: nodes.map(each => [each])}, {runOnly: ["color-contrast"]});
}"""


class AxeFindings(NamedTuple):
    """Rule and HTML of each node that breaks one, and of each that axe could not decide; how many rules it passed."""

    version: str
    violations: list[tuple[str, str]]
    undecided: list[tuple[str, str]]
    rules_passed: int


def axe_findings(page: Page) -> AxeFindings:
    """Run axe on what the page shows."""
    axe: Any = Axe()  # its own annotation of an answer is a bare dict
    said = axe.run(page).response
    violations, undecided = _nodes(said["violations"]), _nodes(said["incomplete"])
    beside = [(node, pseudo) for node in undecided if (pseudo := _pseudo(node[1]))]
    are_apart = page.evaluate(_APART, [[node["target"][0], pseudo] for (_, node), pseudo in beside])
    apart = [node for (node, _), is_apart in zip(beside, are_apart, strict=True) if is_apart]
    if apart:
        again = page.evaluate(_DECIDED, [node["target"][0] for _, node in apart])
        violations += _nodes(again["violations"])
        undecided = [node for node in undecided if node not in apart] + _nodes(again["incomplete"])
    return AxeFindings(
        said["testEngine"]["version"], _html(violations), _html(undecided), len(said["passes"])
    )


def _nodes(rules: list[dict[str, Any]]) -> list[tuple[str, dict[str, Any]]]:
    return [(rule["id"], node) for rule in rules for node in rule["nodes"]]


def _html(nodes: list[tuple[str, dict[str, Any]]]) -> list[tuple[str, str]]:
    return [(rule, node["html"][:200]) for rule, node in nodes]


def _pseudo(node: dict[str, Any]) -> str:
    """Selector of the ancestor whose pseudo-element kept axe from deciding; "" when it was something else."""
    for check in node["any"]:
        if (check["data"] or {}).get("messageKey") == "pseudoContent":
            return check["relatedNodes"][0]["target"][0]
    return ""
