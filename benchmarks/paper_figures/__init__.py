"""The figures of Yan, Huang and Song (CAADRIA 2016), made anew from runs of weavecore."""
