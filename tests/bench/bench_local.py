"""The model on board on the paper's 30 recipes, beside the plan library, with nobody answering.

`python tests/bench/bench_local.py [--published DIR] [--replans N]` prints one table. Each task goes
through the loop three times: with the plan library; with the model, whose examples are the nearest
plans of the library; and with the model when the plan that the library has for this very task is
taken out of it. It needs the extra `local`.
"""
