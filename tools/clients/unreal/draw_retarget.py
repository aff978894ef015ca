#!/usr/bin/python3
"""Draws which bone of the feed drives which bone of the UE5 Mannequin, as an SVG picture.

usage: draw_retarget.py [FILE]      FILE is - for the standard output; default: retarget.svg beside this script

The bones, their places and their names come from config/skeletons/human28.toml.
"""

import pathlib
import sys
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
SKELETON = HERE.parents[2] / "config/skeletons/human28.toml"

WIDTH_PX, HEIGHT_PX = 960, 520
BODY_PX_PER_M, BODY_X_PX, BODY_HIPS_Y_PX = 215, 235, 255
HAND_PX_PER_M, HAND_X_PX, HAND_Y_PX = 1000, 330, 480
TABLE_X_PX, TABLE_Y_PX, ROW_PX = 520, 52, 24.5
INK, QUIET = "#3a4048", "#9aa3ad"

# Chains of an IK rig: name, colour, the bones of the feed in it. The right side is the mirror image of the left.
CHAINS = (
    ("Retarget root", "#3a4048", ("Hips",)),
    ("Spine", "#2f6fb0", ("Chest",)),
    ("Head", "#7a4fb5", ("Neck", "Head")),
    ("LeftClavicle", "#1f8a8a", ("LeftCollar",)),
    ("LeftArm", "#e4572e", ("LeftUpArm", "LeftLowArm", "LeftHand")),
    ("LeftThumb", "#b5852a", ("LeftThumb",)),
    ("LeftIndex", "#b5852a", ("LeftIndex",)),
    ("LeftMiddle", "#b5852a", ("LeftMiddle",)),
    ("LeftRing", "#b5852a", ("LeftRing",)),
    ("LeftPinky", "#b5852a", ("LeftLittle",)),
    ("LeftLeg", "#3c8d53", ("LeftUpLeg", "LeftLowLeg", "LeftFoot")),
)
COLOUR = {bone: colour for _, colour, bones in CHAINS for bone in bones}
NUMBER = {bone: number for number, bone in enumerate((bone for _, _, bones in CHAINS for bone in bones), 1)}


def read_bones():
    """Bone name -> parent, joint in rest pose (m, x forward, y left, z up, from the hips), name in the Mannequin."""
    bones = {}
    for bone in tomllib.loads(SKELETON.read_text(encoding="utf-8"))["bone"]:
        parent = bone.get("parent")
        start = bones[parent][1] if parent else (0.0, 0.0, 0.0)
        joint = tuple(a + b for a, b in zip(start, bone.get("rest_offset_m", (0.0, 0.0, 0.0))))
        bones[bone["name"]] = (parent, joint, bone["aliases"]["unreal"])
    return bones


def is_finger(name):
    return any(finger in name for finger in ("Thumb", "Index", "Middle", "Ring", "Little"))


def line(start, end, colour):
    return (f'<line x1="{start[0]:.1f}" y1="{start[1]:.1f}" x2="{end[0]:.1f}" y2="{end[1]:.1f}" stroke="{colour}" stroke-width="5" '
            'stroke-linecap="round"/>')


def text(x, y, words, colour=INK, more=""):
    return f'<text x="{x:.1f}" y="{y:.1f}" fill="{colour}"{more}>{words}</text>'


def joint(at, name):
    """The dot of a joint, with its number in the table; the right side has none."""
    if name not in NUMBER:
        return f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="4" fill="{QUIET}"/>'
    return (f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="9" fill="#ffffff" stroke="{COLOUR[name]}" stroke-width="2"/>'
            + text(at[0], at[1] + 3.5, NUMBER[name], COLOUR[name], ' text-anchor="middle" font-size="10" font-weight="bold"'))


def figure(bones, shown, place):
    """Lines from each shown bone to its parent, and the joints above them."""
    lines = [line(place(bones[bones[name][0]][1]), place(bones[name][1]), COLOUR.get(name, QUIET))
             for name in shown if bones[name][0]]
    return lines + [joint(place(bones[name][1]), name) for name in shown]


def table(bones):
    parts = [text(TABLE_X_PX, TABLE_Y_PX - 24, "chain of the IK rig", more=' font-weight="bold"'),
             text(TABLE_X_PX + 150, TABLE_Y_PX - 24, "bone of the feed", more=' font-weight="bold"'),
             text(TABLE_X_PX + 300, TABLE_Y_PX - 24, "UE5 Mannequin", more=' font-weight="bold"')]
    y = TABLE_Y_PX
    for chain, colour, names in CHAINS:
        for name in names:
            parts.append(joint((TABLE_X_PX + 132, y - 4), name))
            parts.append(text(TABLE_X_PX, y, chain if name == names[0] else "", colour))
            parts.append(text(TABLE_X_PX + 150, y, name))
            parts.append(text(TABLE_X_PX + 300, y, bones[name][2]))
            y += ROW_PX
    for note in ("The right side is the mirror image. Bones of the Mannequin without a counterpart",
                 "follow their chain or keep their rest pose: root, spine_02 to spine_05, neck_02,",
                 "ball_l, twist bones, second and third joints of the fingers."):
        parts.append(text(TABLE_X_PX, y + 4, note, QUIET, ' font-size="10.5"'))
        y += 16
    return parts


def draw():
    bones = read_bones()
    body = [name for name in bones if not is_finger(name)]
    wrist = bones["LeftHand"][1]
    hand = ["LeftHand"] + [name for name in bones if is_finger(name) and name.startswith("Left")]

    def front(p):  # seen from the front: the left side is on the right
        return BODY_X_PX + p[1] * BODY_PX_PER_M, BODY_HIPS_Y_PX - p[2] * BODY_PX_PER_M

    def above(p):  # seen from above: forward is up
        return HAND_X_PX + (p[1] - wrist[1]) * HAND_PX_PER_M, HAND_Y_PX - 40 - (p[0] - wrist[0]) * HAND_PX_PER_M

    hand_parts = figure({**bones, "LeftHand": (None, *bones["LeftHand"][1:])}, hand, above)
    parts = figure(bones, body, front) + hand_parts + table(bones)
    parts += [text(30, 28, "T-pose of the feed, from the front", more=' font-weight="bold"'),
              text(HAND_X_PX - 10, HAND_Y_PX - 100, "left hand, from above", QUIET, ' font-size="11"')]
    body_text = "\n".join(parts)
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH_PX} {HEIGHT_PX}" font-family="sans-serif" font-size="13">\n'
            f'<rect width="{WIDTH_PX}" height="{HEIGHT_PX}" fill="#ffffff"/>\n{body_text}\n</svg>\n')


def main(arguments):
    if len(arguments) > 1 or (arguments and arguments[0] in ("-h", "--help")):
        print(__doc__)
        return 0 if len(arguments) == 1 else 64
    if arguments == ["-"]:
        sys.stdout.write(draw())
    else:
        pathlib.Path(arguments[0] if arguments else HERE / "retarget.svg").write_text(draw(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
