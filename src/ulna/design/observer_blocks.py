from ulna.design.output_functions import OutputSection
from ulna.design.observer_chain import ChainSearch, failed_search
from ulna.geometry.observability import Observability
from ulna.base.verdict import Verdict
def search_blocks(section: OutputSection, seen: Observability, claim: str) -> ChainSearch:
    return failed_search(section, Verdict.undecided(claim, tried="none"))
