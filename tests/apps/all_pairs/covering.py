# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Covering arrays: few cases in which every pair of choices occurs together.

A case gives each factor one of its choices. A rule is a refusal: a combination of choices that the program must turn
down. Cases are grown greedily, as AETG does it (Cohen, Dalal, Fredman, Patton 1997): from a combination that is still
missing, then factor by factor the choice that covers most of what is missing and that no rule forbids. A combination
that no case without a refusal can hold gets a case of its own that is refused.

A set of choices is a number in which each choice of each factor has a bit: what is asked of sets millions of times is
then one operation of numbers.
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
        """Whether a case is refused by this rule."""
        return all(case.get(factor) in choices for factor, choices in self.when.items())

    def __str__(self):
        return f"status {self.status}, \"{self.says}\""


class Covering:
    def __init__(self, factors, rules, seed=1):
        self.factors = factors
        self.random = random.Random(seed)
        choices = [(name, choice) for name in factors for choice in factors[name]]
        self.bit = {choice: 1 << n for n, choice in enumerate(choices)}
        # Of each rule, and of the rules that a factor has part in: for each factor the choices that bring it about.
        self.rules = [tuple(self.sets(rule).values()) for rule in rules]
        self.rules_of = {name: [(self.sets(rule)[name], [one for other, one in self.sets(rule).items() if other != name])
                                for rule in rules if name in rule.when] for name in factors}
        self.missing = dict.fromkeys(
            pair for names in itertools.combinations(factors, 2)
            for pair in itertools.product(*([(name, choice) for choice in factors[name]] for name in names)))
        self.partners = dict.fromkeys(choices, 0)  # of each choice: those that it has not met
        for one, other in self.missing:
            self.partners[one] |= self.bit[other]
            self.partners[other] |= self.bit[one]

    def sets(self, rule):
        return {name: sum(self.bit[name, choice] for choice in choices) for name, choices in rule.when.items()}

    def refusals(self, held):
        """How many rules are sure to refuse a case, perhaps not whole yet, that holds a set of choices."""
        count = 0
        for rule in self.rules:
            for one in rule:
                if not held & one:
                    break
            else:
                count += 1
        return count

    def grow(self, start, allowed):
        """A whole case around some choices that at most `allowed` rules refuse; None if every way ends at a rule."""
        for _ in range(20):
            case = dict(start)
            held = sum(self.bit[choice] for choice in start)
            rest = [factor for factor in self.factors if factor not in case]
            self.random.shuffle(rest)
            for factor in rest:
                free = self.free(held, factor, allowed)
                if not free:
                    break
                self.random.shuffle(free)
                case[factor] = max(free, key=lambda choice: (self.partners[factor, choice] & held).bit_count())
                held |= self.bit[factor, case[factor]]
            else:
                return case
        return None

    def free(self, held, factor, allowed):
        """The choices that leave the number of refusals within what is allowed."""
        some = [own for own, others in self.rules_of[factor] if all(held & one for one in others)]
        left = allowed - self.refusals(held) if some else 0
        return [c for c in self.factors[factor] if sum(self.bit[factor, c] & own != 0 for own in some) <= left]

    def cross_off(self, case):
        """A case that is refused shows nothing but the refusal: of it those pairs count that are refused."""
        is_refused = self.refusals(sum(self.bit[choice] for choice in case.items())) > 0
        for pair in itertools.combinations(((name, case[name]) for name in self.factors), 2):
            if pair in self.missing and (not is_refused or self.refusals(self.bit[pair[0]] | self.bit[pair[1]])):
                self.meet(pair)

    def meet(self, pair):
        one, other = pair
        del self.missing[pair]
        self.partners[one] &= ~self.bit[other]
        self.partners[other] &= ~self.bit[one]

    def cases(self):
        """All cases: dictionaries from factor to choice. Some of them are refused."""
        cases = []
        while self.missing:
            pair = next(iter(self.missing))
            least = self.refusals(self.bit[pair[0]] | self.bit[pair[1]])
            grown = (self.grow(pair, allowed) for allowed in range(least, least + 3))
            case = next((case for case in grown if case is not None), None)
            if case is None:
                raise ValueError(f"no case can hold {pair}")
            cases.append(case)
            self.cross_off(case)
            if pair in self.missing:
                self.meet(pair)
        return cases
