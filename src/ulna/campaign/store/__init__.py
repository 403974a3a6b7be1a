"""Where the runs of a campaign are kept: in memory or in a folder, and the result that reads them."""

from ulna.campaign.store.batch_file import packed
from ulna.campaign.store.folder import FolderStore, claimed
from ulna.campaign.store.library_versions import changed_versions, check_versions, versions
from ulna.campaign.store.result import CampaignResult, open_campaign
from ulna.campaign.store.store import Batch, Manifest, MemoryStore, Store

__all__ = [
    "Batch",
    "CampaignResult",
    "FolderStore",
    "Manifest",
    "MemoryStore",
    "Store",
    "changed_versions",
    "check_versions",
    "claimed",
    "open_campaign",
    "packed",
    "versions",
]
