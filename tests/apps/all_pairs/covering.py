# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Covering arrays: few cases in which every pair (or triple) of choices occurs together.

A case gives each factor one of its choices. A rule is a refusal: a combination of choices that the program must turn
down. Cases are grown greedily, as AETG does it (Cohen, Dalal, Fredman, Patton 1997): from a combination that is still
missing, then factor by factor the choice that covers most of what is missing and that no rule forbids. A combination
that no case without a refusal can hold gets a case of its own that is refused.
"""
import itertools
import random


class Rule:
    """A refusal: `when` maps factors to the choices that bring it about together; then the program ends with `status`
    and an error that holds `says`."""

    def __init__(self, status, says, **when):
        self.status, self.says = status, says
        self.when = {factor: set(choices) for factor, choices in when.items()}

    def holds(self, case):
        """Whether a case, perhaps not whole yet, is sure to be refused by this rule."""
        return all(case.get(factor) in choices for factor, choices in self.when.items())

    def __str__(self):
        return f"status {self.status}, \"{self.says}\""


class Covering:
    def __init__(self, factors, rules, strength=2, seed=1):
        self.factors, self.rules, self.strength = factors, rules, strength
        self.random = random.Random(seed)
        self.rules_of = {name: [rule for rule in rules if name in rule.when] for name in factors}
        self.missing = dict.fromkeys(
            frozenset(zip(names, choices))
            for names in itertools.combinations(factors, strength)
            for choices in itertools.product(*(factors[name] for name in names)))
    def refusals(self, case):
        return [rule for rule in self.rules if rule.holds(case)]

    def gain(self, case, factor, choice):
        """How many missing combinations the choice completes."""
        added = (factor, choice)
        return sum(frozenset((*others, added)) in self.missing
                   for others in itertools.combinations(case.items(), self.strength - 1))

    def grow(self, start, allowed):
        """A whole case around some choices that at most `allowed` rules refuse; None if every way ends at a rule."""
        for _ in range(20):
            case = dict(start)
            rest = [factor for factor in self.factors if factor not in case]
            self.random.shuffle(rest)
            for factor in rest:
                free = self.free(case, factor, allowed)
                if not free:
                    break
                self.random.shuffle(free)
                case[factor] = max(free, key=lambda choice: self.gain(case, factor, choice))
            else:
                return case
        return None

    def free(self, case, factor, allowed):
        """The choices that leave the number of refusals within what is allowed."""
        some = [rule for rule in self.rules_of[factor] if all(
            case.get(other) in choices for other, choices in rule.when.items() if other != factor)]
        left = allowed - len(self.refusals(case)) if some else 0
        return [c for c in self.factors[factor] if sum(c in rule.when[factor] for rule in some) <= left]

    def cross_off(self, case):
        """A case that is refused shows nothing but the refusal: of it those combinations count that are refused."""
        is_refused = bool(self.refusals(case))
        for group in itertools.combinations(case.items(), self.strength):
            if not is_refused or self.refusals(dict(group)):
                self.missing.pop(frozenset(group), None)

    def cases(self):
        """All cases: dictionaries from factor to choice. Some of them are refused."""
        cases = []
        while self.missing:
            group = next(iter(self.missing))
            least = len(self.refusals(dict(group)))
            grown = (self.grow(dict(group), allowed) for allowed in range(least, least + 3))
            case = next((case for case in grown if case is not None), None)
            if case is None:
                raise ValueError(f"no case can hold {dict(group)}")
            cases.append(case)
            self.cross_off(case)
            self.missing.pop(group, None)
        return cases
