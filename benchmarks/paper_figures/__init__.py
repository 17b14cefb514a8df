"""The figures of Yan, Huang and Song (CAADRIA 2016), reproduced by runs of weavecore."""
