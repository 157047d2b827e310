// The effects of mouse and keys, for glint view --help, its manual page and the window's help.
#pragma once

// KEY(input, effect)
#define VIEW_KEY_LIST(KEY)                                                                                   \
    KEY("drag", "orbit about the point under the cursor")                                                    \
    KEY("Shift drag", "pan; so does the middle button")                                                      \
    KEY("wheel", "move towards the point under the cursor, or away")                                         \
    KEY("double click", "look at that point")                                                                \
    KEY("right drag", "look around; W A S D fly, Q and E sink and rise")                                     \
    KEY("arrows", "orbit about the point looked at, by 5 degrees")                                           \
    KEY("Space", "play or pause an animation; a slow one skips frames")                                      \
    KEY(", .", "previous or next frame; in the time line, click or drag to any")                             \
    KEY("V", "next view: depth, normal, object, shadow, error, color")                                       \
    KEY("1 2 3 4", "precision single, strict, double, certified")                                            \
    KEY("T", "show or hide times, device and samples")                                                       \
    KEY("I", "show or hide what the pixel under the cursor sees; print it")                                  \
    KEY("R", "reset the camera")                                                                             \
    KEY("C", "print the camera as YAML; with --write-camera, write it into its file")                        \
    KEY("K", "record the camera as a key at this frame; needs --write-camera")                               \
    KEY("S", "save the image, once complete, as PNG; Shift S: EXR")                                          \
    KEY("F", "full screen")                                                                                  \
    KEY("H", "show or hide this list")                                                                       \
    KEY("Escape", "close the window")
