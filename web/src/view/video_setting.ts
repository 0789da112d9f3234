// Whether moving frames may be video over slow links. Kept for the session of the tab; not part of
// the view.
import { VideoOffer, type Clock, type VideoOfferHost } from "@windsplat/client/parts";
import { Observable } from "../base/observable";
import { orNull } from "../base/storage";

export type VideoUse = "auto" | "never";

const storageKey = "windsplat.video";
const stored = orNull(() => sessionStorage.getItem(storageKey));
export const videoUse = new Observable<VideoUse>(stored === "never" ? "never" : "auto");
videoUse.watch((use) => orNull(() => sessionStorage.setItem(storageKey, use)));

// The announcement of video to a server as the setting says.
export function offerVideo(clock: Clock, host: Omit<VideoOfferHost, "wanted">): VideoOffer {
  const offer = new VideoOffer(clock, { ...host, wanted: () => videoUse.value === "auto" });
  videoUse.watch(() => offer.changed());
  return offer;
}
