"""The words of English that a request is built with: a table, and nothing about any domain.

What is not listed here, in the domain pack, in the home or in the plan library is a word that has
not been understood. So words that change what is meant ("under", "tomorrow", "if", "until") are
left unread, and so are adjectives: nothing here could see to it that tea is strong.
"""

import re


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


def _phrases(text: str) -> tuple[tuple[str, ...], ...]:
    """The phrases of a table: commas and ends of lines part them."""
    parts = re.split(r",\s|\n", text)
    return tuple(tuple(part.split()) for part in parts if part.strip())


DETERMINERS = _words("a an the some any my our your his her their this that these those all both")
"""Words that may stand inside a name: "clean up all the toys"."""

GRAMMAR = DETERMINERS | _words("""
    i we you me us he she it they them him myself yourself ourselves i'm i'd i'll i've we'd
    we'll we're you'd you're he's she's they're it's that's let's there's here is are am be
    's 'd 'm
    so as well can could would will shall should may might must do does d ll ve s m re too
    who which please pls plz kindly thanks thank cheers hi hello hey dear ok okay sir
    madam robot adaptbot just now right away today tonight quickly quick soon asap fast
    ready simply really very much maybe perhaps also first finally afterwards next again
    whole bit little lot lots plenty more enough extra such kind sort type everyone
    everybody anything something nice good great tasty delicious fine lovely favourite
    favorite own one's mind possible lets hungry thirsty starving wanna gimme lemme u ur
    alright yes yeah yep bye
    🙂 🙃 😀 😃 😄 😁 😆 😊 😇 😋 😍 😘 😉 🤗 🤤 🙏 👍 ❤ ☺ ♥
""")
"""Words that carry no condition of their own: pronouns, auxiliaries, courtesy, vague quantities."""

COURTESY = _phrases("""
    how about, what about, go ahead, go and, i wonder if, i'm wondering if, i was wondering if
    feel like, could do with, in the mood for, any chance of, trouble you for, time for, i order
    whip up, rustle up, knock up, drink it, drink them, there is, there are, is there, are there
    hi there, hello there, hey there, good morning, good afternoon, good evening
    this morning, this afternoon, this evening, this weekend
    your job is to, your task is to, the task is to, task :, do the following, the following
    if you can, if you could, if you please, if you would, if possible, if you don't mind
    when you have time, when you can, when you get a chance, when you have a moment
    i'd be glad if, i'd be happy if, i'd be grateful if, i would be glad if, i would be happy if
    i would be grateful if, i'll be glad if, i'll be happy if, i'll be grateful if
    i will have, i'll have, i'm going to have, i am going to have, let me have, i will take
    i'll take, let me get, i'll get, i'll need, i will need, i'll try, i'll go for
""")
"""Phrases that only ask, though their words do not by themselves."""

OTHERS = _phrases("""
    she will, he will, they will, she should, he should, they should, she wants to, he wants to
    i will, i'll, i'm going to, i am going to, let me, have you
""")
"""Beginnings that leave what follows to somebody else, or ask whether it has been done."""

QUESTIONS = _words("is are does has who")
"""Words that make a question of a request where they begin it."""

PRONOUNS = _words("it them this that these those one")
"""Words that stand for what a step before was about."""

IT = _words("it them")
"""Pronouns for what has just been named."""

MORE = _words("extra plenty lots more some just")
"""Words before what is wanted after all: "no tomato, extra cheese"."""

VAGUE = _words("extra plenty lots lot whole few big small")
"""Quantities that no plan measures, unless they only join what is wanted after all."""

HEDGES = _words("just much too very so really quite that enough")
"""Words that weaken the negation before them: "not just milk", "not too much sugar"."""

CONDITIONS = _words("""
    only if unless until while when whenever before after during since each every another other how
    what why where whose was were been being did had under over above below between against
    tomorrow yesterday later almost less least fewer half easy cold hot raw barely hardly
    scarcely double triple keep leave optional anywhere there till within
    whatever whichever whatsoever low high kosher halal mild spicy large tiny
    huge healthy homemade crispy creamy
""")
"""Words that change what is meant, so that they are never read, and never as slips of the pen."""

ADVERBS = _words("""
    upstairs downstairs outside outdoors indoors inside twice thrice often always sometimes daily
    weekly monthly together well properly apart aside
""")
"""Words that say where, how or how often, and name nothing; so do those in -ly."""

VERBS = _words("""
    make making made get getting give giving bring fetch have has having got need want wants
    like likes love loves eat eats eating drinks tolerate stand fancy fix prepare preparing do
    doing help let try create produce whip rustle
""")
"""Verbs that ask for a thing to be had, whatever the thing is."""

USES = _words(
    """
    use using add adding put putting include including eat eats have want like likes need give
    drink tolerate stand eating
"""
)
"""Verbs after which a negation rules out a thing, not the task: "don't use milk"."""

WITH = _phrases("""
    with, including, containing, using, use, add, adding, made with, made of, made from
    topped with, filled with, served with, made out of, along with, together with, w/
    don't forget, dont forget, do not forget
""")
"""What leads to something that goes in."""

WITHOUT = _phrases("""
    without, w/o, no, not, minus, except, excluding, never, none, nothing, neither, nor, omit
    omitting, don't, dont, do not, doesn't, does not, didn't, can't, cannot, cant, can not
    won't, shouldn't, mustn't, must not, should not, isn't, avoid, avoiding, skip, hold the
    leave out, leave off, leaving out, instead of, rather than, in place of, free of, free from
    hate, hates, dislike, dislikes, replace, anything but, everything but, all but, replacing
    swap, substitute, ban, lacking, sans, made without, zero, 0, w/out, devoid of, are out of
    we're out of, i'm out of, ran out of, except for, apart from, aside from, other than
    drop the, lose the, ditch, forget the
""")
"""What leads to something that must not go in."""

VERBAL = _words("don't dont not never doesn't can't cannot cant won't shouldn't mustn't stop")
"""Negations that, before the verb of a task, rule the task itself out; "do not" is one as well."""

NONE = _words("no none nothing neither nor not never zero 0")
"""Negations that only repeat one before them: "don't put no milk in"."""

SWAPS = _words("replace replacing swap substitute")
"""Negations of which "for" leads to what is wanted instead: "swap sugar for honey"."""

ALLERGY = _phrases("""
    allergic to, intolerant to, allergy to, sensitive to, free of, free from, intolerance to
    intolerant of
""")
"""What leads to something that may do harm, and before which no guess is safe."""

AFTER_ALLERGEN = _words("free allergy allergies allergic intolerance intolerant allergen")
"""Words behind what must not go in: "dairy-free", "a nut allergy"."""

AND = _phrases("""
    and then, and also, and, then, after that, &, +, plus, as well as, followed by
    and after that
""")
OR = (("or",), ("either",), ("/",))
BUT = (("but",), ("though",), ("however",))
TO = _phrases("""
    to, into, onto, in, on, at, by, inside, over to, served on, served in, served at
""")
FROM = (("from",), ("off",))
OF, FOR = (("of",),), (("for",),)

PEOPLE = _words("""
    person people guest guests friend friends family kid kids child children son daughter wife
    husband partner mum mom mother dad father grandma grandpa grandmother grandfather brother
    sister neighbour neighbours neighbor neighbors visitor visitors colleague colleagues
    everyone everybody someone somebody girlfriend boyfriend
""")
PERSONS = _words("me you him her them us myself yourself")
"""Pronouns of whom something is for."""

POINTERS = PERSONS | PRONOUNS | PEOPLE | _words("here there which who")
"""Words to which a preposition may lead: "to me", "in it", "in there"."""

CROWDS = _words("family people children us them you")
"""Several people in a word without a plural s; their number is unknown."""

EVERYONE = _words("everyone everybody all both")
"""People whose number is unknown."""

OCCASIONS = _words("""
    breakfast lunch dinner supper brunch tea-time teatime snack meal dessert starter picnic
    party morning afternoon evening weekend
""")
"""Whom or what something may be for, without that changing it."""

NUMBERS = {
    word: number
    for number, word in enumerate(
        "one two three four five six seven eight nine ten eleven twelve".split(),  # noqa: SIM905
        start=1,
    )
} | {"dozen": 12, "couple": 2, "pair": 2, "twice": 2, "double": 2, "thrice": 3}


TIMES = (
    rf"(?:(?:\d{{1,3}}|{'|'.join(NUMBERS)})[ ](?:(?:more|full|whole)[ ])?times?\b"
    r"|(?<!\w)(?:[x×][ ]?\d{1,3}|\d{1,3}[ ]?[x×])(?!\w)|\b(?:twice|thrice)\b)"
)
"""A pattern of how often a thing is done: "twice", "3 more times", "x2"."""

UNCOUNTED = (
    r"\b(?:(?:several|many|multiple|some|a[ ]few|a[ ]couple[ ]of)[ ](?:more[ ])?times"
    r"|(?:again|over)[ ]and[ ](?:again|over)|repeatedly"
    r"|every[ ](?:few[ ]|other[ ]|\d+[ ])?(?:second|minute|hour)s?)\b"
)
"""A pattern of repetitions without a number."""

ALL = _words("all every each any everything everyone")
"""Words behind which "but" leads to what is left out: "all the plants but the cactus"."""

REPETITIONS = _words("times count repeat repeats repetitions reps iterations loop rounds cycles")
"""The keys of structures and calls that hold the number of repetitions."""


def count_of(text: str) -> int:
    """Return the count in "2", "twice" or "3 times", 0 if there is none."""
    words = re.findall(r"-|\d+|[^\W\d]+", text.lower().replace("×", "x")[:40])
    named = [word for word in words if word not in ("x", "times", "time", "more", "full", "whole")]
    if len(named) != 1:
        return 0
    digits = named[0].isascii() and named[0].isdigit() and len(named[0]) < 6
    return int(named[0]) if digits else NUMBERS.get(named[0], 0)


UNITS = _words("""
    teaspoon teaspoons tablespoon tablespoons tsp tbsp gram grams g kg kilo kilos litre litres
    liter liters l ml cl
""")
"""Units: how many of them there are to be is no number of servings."""

OF_TIME = _words(
    "second seconds minute minutes min mins hour hours o'clock am pm degrees time times"
)
"""Units of what no plan is counted by."""

MEASURES = UNITS | _words("""
    cup cups mug mugs glass glasses bowl bowls plate plates pot pots slice slices piece pieces
    pinch spoon spoonful spoons handful bunch portion portions serving
    servings helping helpings batch round rounds dash drop drops bottle bottles jug set
""")
"""Words for how much: things only where the home has such a thing and something is in it."""
