"""Watch a body at work in MuJoCo's viewer, and disturb it.

Drag a node with the mouse (double click selects, Ctrl + Shift + right button drags) and watch the
rhythm recover. Keys: 6, 7 freeze output x1, x2; 8 kicks all nodes; 9 takes the next readout;
0 starts again. Needs a screen; on macOS run it as: mjpython -m mcmj view.
"""

GROUP = "pictures"
