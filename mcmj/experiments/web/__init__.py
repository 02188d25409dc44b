"""A body as one web page that runs MuJoCo: pull at it.

page.html needs no other file and no network: open it with a double click. Pull a mass with the
mouse or a finger, freeze outputs, kick, change readout, input and speed. page.html#check repeats
a run of mcmj's and says the largest difference. MuJoCo's WebAssembly package is fetched by npm
once, or given by --package.
"""

GROUP = "pictures"
