"""The only wiring (`build`), and the only loop that performs turns (`drive`)."""
