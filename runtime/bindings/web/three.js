// three.js: a camera that hears and objects that sound, for three.js.
//
//   const ears = new ClamorThreeListener(await clamor.listen(level), camera);
//   const bell = new ClamorThreeSource(await clamor.addSource(sound), object);
//   in the loop: ears.update(); bell.update();
import {Quaternion, Vector3} from "three";

const place = new Vector3();
const turn = new Quaternion();

export class ClamorThreeListener {
  constructor(listener, camera) {
    Object.assign(this, {listener, camera});
  }

  update() {
    this.listener.move(this.camera.getWorldPosition(place).toArray(), this.camera.getWorldQuaternion(turn).toArray());
  }
}

export class ClamorThreeSource {
  constructor(source, object) {
    Object.assign(this, {source, object});
  }

  // The object's +Z is where getWorldDirection() looks, and the axis of the directivity.
  update() {
    const position_m = this.object.getWorldPosition(place).toArray();
    this.source.move(position_m, undefined, this.object.getWorldDirection(place).toArray());
  }
}
