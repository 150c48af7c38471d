(function(){"use strict";const Ee=`
#define ROW 44
#define EDGE 1e-6
layout(std140) uniform Edits { vec4 rows[1024]; };
uniform sampler2D lattice;
uniform int editCount;
uniform int boxCount;
uniform bool preserveOpacity;

float largest(vec3 v) { return max(max(v.x, v.y), v.z); }

bool inBox(vec3 p, vec3 low, vec3 high) { return all(greaterThanEqual(p, low)) && all(lessThanEqual(p, high)); }

vec3 times(int at, vec3 v) { return vec3(dot(rows[at].xyz, v), dot(rows[at + 1].xyz, v), dot(rows[at + 2].xyz, v)); }

vec3 solveColumns(vec3 u, vec3 v, vec3 w, vec3 r) {
  vec3 vw = cross(v, w);
  float det = dot(u, vw);
  if (abs(det) < 1e-6) det = det >= 0.0 ? 1e-6 : -1e-6;
  return vec3(dot(r, vw), dot(u, cross(r, w)), dot(u, cross(v, r))) / det;
}

vec3 bendSolve(int at, vec3 xi, vec3 r) {
  vec3 a = rows[at].xyz;
  vec3 b = rows[at + 1].xyz;
  vec3 c = rows[at + 2].xyz;
  vec3 g = rows[at + 3].xyz;
  return solveColumns(
    vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g,
    vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g,
    vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g,
    r
  );
}

vec3 bent(int at, vec3 xi) {
  return xi + xi.x * xi.y * rows[at].xyz + xi.x * xi.z * rows[at + 1].xyz + xi.y * xi.z * rows[at + 2].xyz
    + xi.x * xi.y * xi.z * rows[at + 3].xyz;
}

// Coordinates in the hexahedron at a row, clamped to [-1,1]^3, and how far off that is.
vec3 hexahedron(vec3 p, int at, out float error) {
  vec3 y = times(at, p - rows[at + 3].xyz);
  vec3 xi = y;
  error = 0.0;
  if (rows[at].w < 0.5) {
    if (inBox(y, rows[at + 4].xyz, rows[at + 5].xyz)) {
      xi = clamp(y, -1.0, 1.0);
      for (int n = 0; n < 16; n++) {
        vec3 next = clamp(xi - bendSolve(at + 6, xi, bent(at + 6, xi) - y), -1.4, 1.4);
        float by = largest(abs(next - xi));
        xi = next;
        if (by < 1e-4) break;
      }
      error = largest(abs(bent(at + 6, xi) - y));
      if (error < 2e-6) error = 0.0;
    } else {
      error = 10.0;
    }
  }
  error += max(largest(abs(xi)) - 1.0, 0.0);
  return clamp(xi, -1.0, 1.0);
}

// Takes p and the direction v to canonical space by the coordinates xi in the hexahedron at a row.
void image(vec3 xi, int at, inout vec3 p, inout vec3 v) {
  vec3 along = times(at, v);
  int c = at + 10;
  vec3 c1 = rows[c + 1].xyz;
  vec3 c2 = rows[c + 2].xyz;
  vec3 c4 = rows[c + 4].xyz;
  p = rows[c].xyz + xi.x * c1 + xi.y * c2 + xi.z * c4;
  if (rows[at].w < 0.5) {
    along = bendSolve(at + 6, xi, along);
    vec3 c3 = rows[c + 3].xyz;
    vec3 c5 = rows[c + 5].xyz;
    vec3 c6 = rows[c + 6].xyz;
    vec3 c7 = rows[c + 7].xyz;
    p += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7;
    c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7;
    c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7;
    c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7;
  }
  v = along.x * c1 + along.y * c2 + along.z * c4;
}

vec3 node(int n) { return texelFetch(lattice, ivec2(n & 2047, n >> ${Math.log2(2048)}), 0).xyz; }

void interpolate(int e, int resolution_, vec3 at, inout vec3 p, inout vec3 v) {
  vec3 s = times(e + 3, v);
  vec3 g = clamp(at, 0.0, float(resolution_ - 1));
  ivec3 cell = min(ivec3(g), resolution_ - 2);
  vec3 f = g - vec3(cell);
  int plane = resolution_ * resolution_;
  int n = int(rows[e + 6].w) + (cell.z * resolution_ + cell.y) * resolution_ + cell.x;
  vec3 v000 = node(n);
  vec3 v010 = node(n + resolution_);
  vec3 v001 = node(n + plane);
  vec3 v011 = node(n + plane + resolution_);
  vec3 x00 = node(n + 1) - v000;
  vec3 x10 = node(n + resolution_ + 1) - v010;
  vec3 x01 = node(n + plane + 1) - v001;
  vec3 x11 = node(n + plane + resolution_ + 1) - v011;
  vec3 w00 = v000 + f.x * x00;
  vec3 w10 = v010 + f.x * x10;
  vec3 w01 = v001 + f.x * x01;
  vec3 w11 = v011 + f.x * x11;
  vec3 y0 = w10 - w00;
  vec3 y1 = w11 - w01;
  vec3 z0 = w00 + f.y * y0;
  vec3 z1 = w01 + f.y * y1;
  vec3 x0 = x00 + f.y * (x10 - x00);
  vec3 x1 = x01 + f.y * (x11 - x01);
  p += z0 + f.z * (z1 - z0);
  v += s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0);
}

// Takes a sample through the edit whose numbers begin at a row; true where it was emptied.
bool mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + 3].w > 0.5;
  int resolution_ = int(rows[e + 2].w);
  int first = e + 8;
  if (rows[e + 4].w > 0.5) {
    vec3 y = times(first, p - rows[first + 3].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return false;
    }
    vec3 at = times(e + 3, p - rows[e + 2].xyz);
    if (inBox(at, rows[e + 6].xyz, rows[e + 7].xyz)) interpolate(e, resolution_, at, p, v);
    return false;
  }
  float error;
  if (rows[e].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return false;
    }
  }
  if (rows[e + 1].w < 1.5) return false;
  hexahedron(p, first + 18, error);
  if (!continuous) return error <= EDGE;
  if (error <= EDGE) interpolate(e, resolution_, times(e + 3, p - rows[e + 2].xyz), p, v);
  return false;
}

MAP_SAMPLE
// The part of a ray outside which no edit changes anything.
vec2 editedPart(vec3 origin, vec3 d) {
  vec2 part = vec2(1e30, -1e30);
  vec3 inverse_ = safeInverse(d);
  for (int k = 0; k < boxCount; k++) {
    int at = editCount * ROW + 2 * k;
    vec2 through = slab(origin, inverse_, rows[at].xyz, rows[at + 1].xyz);
    if (through.x <= through.y) part = vec2(min(part.x, through.x), max(part.y, through.y));
  }
  return part;
}

vec3 throughEdits(vec3 slope, vec3 p) {
  vec3 result;
  for (int a = 0; a < 3; a++) {
    vec3 q = p;
    vec3 v = vec3(a == 0, a == 1, a == 2);
    mapSample(q, v);
    result[a] = dot(slope, v);
  }
  return result;
}
`,Te=2;function be(o){return o<=Te?o:null}function Re(o){const e=s=>`if (inBox(p, rows[${s}].xyz, rows[${s} + 1].xyz) && mapEdit(${s}, p, v)) return true;`,r=["bool mapSample(inout vec3 p, inout vec3 v) {",...(o===null?[`for (int n = editCount - 1; n >= 0; n--) { ${e("n * ROW")} }`]:Array.from({length:o},(s,n)=>e(`${o-1-n} * ROW`))).map(s=>`  ${s}`),"  return false;","}"];return Ee.replace("MAP_SAMPLE",`${r.join(`
`)}
`)}class C extends Error{}function Ae(o,e){const t=o.field.brick,r=t+1,s=o.header.resolution.map(d=>Math.ceil((d-1)/t)),n=Ue(o,s),i=Math.min(255,Math.floor(e/r)),a=Math.min(i,Math.max(1,Math.ceil(Math.cbrt(n.length)))),c=Math.min(i,Math.max(1,Math.ceil(Math.sqrt(n.length/a)))),l=Math.max(1,Math.ceil(n.length/(a*c)));if(l>i)throw new C(`${n.length} bricks do not fit into textures of ${e} texels an edge`);const u=new Uint8Array(4*s[0]*s[1]*s[2]);for(const[d,m]of n.entries())u.set([d%a,Math.floor(d/a)%c,Math.floor(d/(a*c)),255],4*m);const h=Math.ceil(3*o.header.steps.length/4);return{brick:t,edge:r,dims:s,across:[a,c,l],count:n.length,index:u,bricks:n,colours:h}}function _e({across:o,edge:e,colours:t,index:r}){return o[0]*o[1]*o[2]*e**3*(2+4*t)+r.length}function Ue(o,e){const{codes:t,dims:r}=o.occupancy,s=o.field.brick/4,n=new Uint8Array(e[0]*e[1]*e[2]);let i=0;for(let a=0;a<r[0];a++)for(let c=0;c<r[1];c++)for(let l=0;l<r[2];l++,i++)t[i]<256&&(n[(Math.floor(a/s)*e[1]+Math.floor(c/s))*e[2]+Math.floor(l/s)]=1);return Int32Array.from(n.keys()).filter(a=>n[a]===1)}class Se{constructor(e,t){this.level=e,this.layout=t;const{brick:r}=t;this.wire=e.header.resolution.map(a=>Math.ceil(a/r));const s=r**3;this.numbers=new Int32Array(e.bricks.length).fill(-1),this.slots=new Int32Array(e.masks.length/(s/8)*s).fill(-1);let n=0;e.bricks.forEach((a,c)=>{a&&(this.numbers[c]=n++)});let i=0;for(let a=0;a<this.slots.length;a++)e.masks[a>>3]>>(a&7)&1&&(this.slots[a]=i++)}slots;numbers;wire;layer(e){const{across:t,edge:r,count:s,colours:n,bricks:i}=this.layout,a=t[0]*t[1]*r**3,c={density:new Uint16Array(a),colours:Array.from({length:n},()=>new Uint8Array(4*a).fill(128))},l=e*t[0]*t[1],u=new Int32Array(r**3);for(let h=l;h<Math.min(s,l+t[0]*t[1]);h++)this.vertices(i[h],u),this.put(c,h-l,u);return c}vertices(e,t){const{dims:r,brick:s,edge:n}=this.layout,i=[Math.floor(e/(r[1]*r[2])),Math.floor(e/r[2])%r[1],e%r[2]];let a=0;for(let c=0;c<n;c++)for(let l=0;l<n;l++)for(let u=0;u<n;u++,a++){const h=c<s?i[0]:i[0]+1,d=l<s?i[1]:i[1]+1,m=u<s?i[2]:i[2]+1;if(t[a]=-1,h>=this.wire[0]||d>=this.wire[1]||m>=this.wire[2])continue;const f=this.numbers[(h*this.wire[1]+d)*this.wire[2]+m];f>=0&&(t[a]=this.slots[((f*s+c%s)*s+l%s)*s+u%s])}}put(e,t,r){const{across:s,edge:n}=this.layout,{density:i,sh:a,header:c}=this.level,l=s[0]*n,u=l*s[1]*n,h=t%s[0]*n+Math.floor(t/s[0])*n*l,d=3*c.steps.length;let m=0;for(let f=0;f<n;f++)for(let p=0;p<n;p++)for(let y=0;y<n;y++,m++){const T=r[m];if(T<0)continue;const g=h+f*u+p*l+y;e.density[g]=i[T];for(let w=0;w<d;w++)e.colours[w>>2][4*g+(w&3)]=a[w*c.vertices+T]}}}function O(o,e,t){const r=performance.now(),s=o.createProgram();for(const[a,c]of[[o.VERTEX_SHADER,e],[o.FRAGMENT_SHADER,t]]){const l=o.createShader(a);if(l===null)throw new Error("the GPU's context is lost");o.shaderSource(l,c),o.compileShader(l),o.attachShader(s,l),o.deleteShader(l)}if(o.linkProgram(s),!o.getProgramParameter(s,o.LINK_STATUS)&&!o.isContextLost()){const c=(o.getAttachedShaders(s)??[]).map(l=>o.getShaderInfoLog(l)??"");throw new Error(`a shader does not compile: ${c.join(" ")} ${o.getProgramInfoLog(s)??""}`)}const n=new Map;return{program:s,uniform:a=>{const c=n.get(a);if(c!==void 0)return c;const l=o.getUniformLocation(s,a);return n.set(a,l),l},milliseconds:performance.now()-r}}function B(o,e,t,r){for(;o.getError()!==o.NO_ERROR;);const s=o.createTexture();if(o.bindTexture(o.TEXTURE_3D,s),o.texStorage3D(o.TEXTURE_3D,1,e,t[0],t[1],t[2]),k(o,o.TEXTURE_3D,r),o.getError()===o.OUT_OF_MEMORY)throw o.deleteTexture(s),new Error("the GPU has not enough memory for the field");return s}function k(o,e,t){o.texParameteri(e,o.TEXTURE_MIN_FILTER,t),o.texParameteri(e,o.TEXTURE_MAG_FILTER,t);for(const r of e===o.TEXTURE_3D?[o.TEXTURE_WRAP_S,o.TEXTURE_WRAP_T,o.TEXTURE_WRAP_R]:[o.TEXTURE_WRAP_S,o.TEXTURE_WRAP_T])o.texParameteri(e,r,o.CLAMP_TO_EDGE)}function U(o){o.bindBuffer(o.PIXEL_UNPACK_BUFFER,null),o.pixelStorei(o.UNPACK_ALIGNMENT,1),o.pixelStorei(o.UNPACK_FLIP_Y_WEBGL,!1),o.pixelStorei(o.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),o.pixelStorei(o.UNPACK_COLORSPACE_CONVERSION_WEBGL,o.NONE);for(const e of[o.UNPACK_ROW_LENGTH,o.UNPACK_IMAGE_HEIGHT,o.UNPACK_SKIP_PIXELS,o.UNPACK_SKIP_ROWS,o.UNPACK_SKIP_IMAGES])o.pixelStorei(e,0)}async function Me(o,e,t,r){const s=Ae(e,o.getParameter(o.MAX_3D_TEXTURE_SIZE)),n=_e(s);if(n>t)throw new C(`the field takes ${Math.ceil(n/2**20)} MiB of the GPU, more than the ${Math.floor(t/2**20)} allowed`);const{across:i,edge:a,dims:c}=s,l=i.map(h=>h*a),u=[];try{const h=B(o,o.R16F,l,o.LINEAR);u.push(h);const d=Array.from({length:s.colours},()=>{const p=B(o,o.RGBA8,l,o.LINEAR);return u.push(p),p}),m=new Se(e,s);for(let p=0;p<i[2];p++){const y=m.layer(p);U(o);const T=(g,w,x,v)=>{o.bindTexture(o.TEXTURE_3D,g),o.texSubImage3D(o.TEXTURE_3D,0,0,0,p*a,l[0],l[1],a,w,x,v)};if(T(h,o.RED,o.HALF_FLOAT,y.density),y.colours.forEach((g,w)=>T(d[w],o.RGBA,o.UNSIGNED_BYTE,g)),o.bindTexture(o.TEXTURE_3D,null),await new Promise(g=>setTimeout(g)),!r())throw new Error("not wanted any more")}U(o);const f=B(o,o.RGBA8UI,[c[2],c[1],c[0]],o.NEAREST);return u.push(f),o.texSubImage3D(o.TEXTURE_3D,0,0,0,0,c[2],c[1],c[0],o.RGBA_INTEGER,o.UNSIGNED_BYTE,s.index),o.bindTexture(o.TEXTURE_3D,null),{layout:s,density:h,colours:d,index:f,bytes:n}}catch(h){for(const d of u)o.deleteTexture(d);if(!r())return null;throw h}}function Z(o,{dims:e,codes:t}){U(o);const r=B(o,o.R16UI,[e[2],e[1],e[0]],o.NEAREST);return o.texSubImage3D(o.TEXTURE_3D,0,0,0,0,e[2],e[1],e[0],o.RED_INTEGER,o.UNSIGNED_SHORT,t),o.bindTexture(o.TEXTURE_3D,null),r}function ze(o,e){for(const t of[e.density,e.index,...e.colours])o.deleteTexture(t)}class P{constructor(e,t=()=>{}){this.onArrival=t,this.source=(e instanceof ArrayBuffer?new Blob([e]).stream():e).getReader()}held=[];length=0;arrived=0;source;async take(e){for(;this.length<e;){const{value:s,done:n}=await this.source.read();if(n)throw new Error("the file of the field is truncated");this.held.push(s),this.length+=s.length,this.arrived+=s.length,this.onArrival(this.arrived)}const t=new Uint8Array(e);let r=0;for(;r<e;){const s=this.held[0],n=s.subarray(0,e-r);t.set(n,r),r+=n.length,n.length===s.length?this.held.shift():this.held[0]=s.subarray(n.length)}return this.length-=e,t}cancel(){this.source.cancel().catch(()=>{})}}async function De(o){const e=new Blob([o]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(e).arrayBuffer()}class S{constructor(e,t,r){this.header=e,this.entries=t,this.reader=r}next=0;static async open(e,t,r){const s=await e.take(16),n=new DataView(s.buffer);if(String.fromCharCode(...s.subarray(0,8))!==t)throw new Error(`not a file of the kind "${t}"`);const i=n.getUint32(8,!0);if(i!==r)throw new Error(`"${t}" of version ${i}, this page reads ${r}; reload it`);const a=new TextDecoder().decode(await e.take(n.getUint32(12,!0))),c=JSON.parse(a);return new S(c,c.arrays,e)}get left(){return this.entries.slice(this.next).reduce((e,t)=>e+t.bytes,0)}async read(e){const t=this.entries.at(this.next);if(t?.name!==e)throw new Error(`the file of the field has no array "${e}" here`);this.next++;const r=await De(await this.reader.take(t.bytes));switch(t.type){case"u1":return new Uint8Array(r);case"u2":return new Uint16Array(r);case"i4":return new Int32Array(r);case"f4":return new Float32Array(r)}}}const Oe="cagepage",Ie=1;async function*Ne(o,e){const t=new P(o,e);try{const r=await S.open(t,Oe,Ie);for(const[s,n]of r.header.levels.entries()){const i=await r.read(`${s}.bricks`),a=await r.read(`${s}.masks`),c=await r.read(`${s}.occupancy`),l=await r.read(`${s}.density`),u=await r.read(`${s}.sh`);yield{field:r.header,header:n,last:s===r.header.levels.length-1,bricks:i,masks:a,density:J(l),sh:Fe(u,n.vertices),occupancy:{origin:[0,0,0],dims:n.dims,codes:c}}}}finally{t.cancel()}}function J(o){const e=o.length/2,t=new Uint16Array(e);for(let r=0;r<e;r++)t[r]=o[r]|o[e+r]<<8;return t}function Fe(o,e){for(let t=0;t<o.length;t+=e){let r=128;for(let s=t;s<t+e;s++)o[s]=r=r+o[s]&255}return o}const W=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y)","2.890611442640554 * d.x * d.y * d.z","-0.4570457994644658 * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","0.3731763325901154 * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y)","-0.4570457994644658 * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","1.445305721320277 * d.z * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y)","2.5033429417967046 * d.x * d.y * (d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.y * d.z * (3.0 * d.x * d.x - d.y * d.y)","0.9461746957575601 * d.x * d.y * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-0.6690465435572892 * d.y * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.10578554691520431 * (8.0 * d.z * d.z * d.z * d.z - 24.0 * d.z * d.z * (d.x * d.x + d.y * d.y) + 3.0 * (d.x * d.x + d.y * d.y) * (d.x * d.x + d.y * d.y))","-0.6690465435572892 * d.x * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.47308734787878004 * (d.x * d.x - d.y * d.y) * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.x * d.z * (d.x * d.x - 3.0 * d.y * d.y)","0.6258357354491761 * (d.x * d.x * (d.x * d.x - 3.0 * d.y * d.y) - d.y * d.y * (3.0 * d.x * d.x - d.y * d.y))"];function Le(o){const e=Math.ceil(3*o/4),t=[`uniform float coefficientSteps[${o}];`,...Array.from({length:e},(r,s)=>`uniform sampler3D colourAtlas${s};`),"vec3 colourAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:e},(r,s)=>`  vec4 s${s} = 255.0 * textureLod(colourAtlas${s}, at, 0.0) - 128.0;`)];for(let r=0;r<o;r++){const s=[0,1,2].map(n=>`s${3*r+n>>2}.${"xyzw"[3*r+n&3]}`);t.push(`  rgb += (coefficientSteps[${r}] * (${W[r]})) * vec3(${s.join(", ")});`)}return{source:[...t,"  return rgb;","}"].join(`
`),colours:e}}const Ce=`
uniform sampler3D densityAtlas;
uniform usampler3D brickIndex;
uniform usampler3D bricks;
uniform vec3 atlasScale;
uniform ivec3 indexDims;
uniform ivec3 bricksOrigin;
uniform ivec3 bricksDims;
uniform ivec3 resolution;
uniform vec3 lower;
uniform vec3 scale;
uniform vec3 halfGrid;
uniform float unit;
uniform float marchStep;
uniform float near;
uniform vec3 background;
uniform vec3 eye;
uniform mat3 rotation;
uniform vec4 lens;
uniform float height;
layout(location = 0) out vec4 outColour;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
layout(location = 2) out vec4 outNormal;
#endif

vec3 contract(vec3 q) {
  float m = max(max(max(abs(q.x), abs(q.y)), abs(q.z)), 1.0);
  return ((2.0 - 1.0 / m) / m) * q;
}

vec3 contractVelocity(vec3 q, vec3 d) {
  vec3 a = abs(q);
  float m = max(max(a.x, a.y), a.z);
  if (m <= 1.0) return d;
  float dm = d.x * sign(q.x);
  if (a.y >= m) dm = d.y * sign(q.y);
  if (a.z >= m) dm = d.z * sign(q.z);
  return ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q;
}

vec2 slab(vec3 origin, vec3 inverse_, vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse_;
  vec3 b = (high - origin) * inverse_;
  vec3 first = min(a, b);
  vec3 last = max(a, b);
  return vec2(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

vec3 safeInverse(vec3 d) { return 1.0 / mix(d, vec3(1e-12), lessThan(abs(d), vec3(1e-12))); }

float emptyRun(vec3 g, vec3 inverse_) {
  ivec3 cell = ivec3(floor(g)) - bricksOrigin;
  ivec3 b = clamp(cell >> 2, ivec3(0), bricksDims - 1);
  int code = int(texelFetch(bricks, b.zyx, 0).r);
  ivec3 low;
  int size;
  if (code >= 256) {
    int d = code >> 8;
    low = (b - (d - 1)) * 4;
    size = (2 * d - 1) * 4;
  } else {
    ivec3 s = (cell >> 1) & 1;
    if (((code >> (s.x * 4 + s.y * 2 + s.z)) & 1) == 1) return -1.0;
    low = (cell >> 1) << 1;
    size = 2;
  }
  vec3 lo = vec3(low + bricksOrigin);
  vec3 last = max((lo - g) * inverse_, (lo + float(size) - g) * inverse_);
  return max(min(min(last.x, last.y), last.z), 0.0);
}

vec3 toGrid(vec3 p) {
  vec3 g = (p - lower) * scale;
#ifdef CONTRACTED
  g = (contract(g) + 2.0) * halfGrid;
#endif
  return g;
}

// The texel, whole where a vertex is, of grid coordinates in the atlas; false where their brick is empty.
bool locate(vec3 g, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 place = texelFetch(brickIndex, b.zyx, 0);
  corner = ivec3(place.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return place.a > 0u;
}

// Gradient of the interpolated density in grid coordinates.
vec3 densitySlope(vec3 texel, ivec3 corner) {
  ivec3 cell = corner + min(ivec3(texel) - corner, ivec3(BRICK - 1));
  vec3 f = texel - vec3(cell);
  vec3 e = 1.0 - f;
  float r000 = texelFetch(densityAtlas, cell, 0).r;
  float r100 = texelFetch(densityAtlas, cell + ivec3(1, 0, 0), 0).r;
  float r010 = texelFetch(densityAtlas, cell + ivec3(0, 1, 0), 0).r;
  float r110 = texelFetch(densityAtlas, cell + ivec3(1, 1, 0), 0).r;
  float r001 = texelFetch(densityAtlas, cell + ivec3(0, 0, 1), 0).r;
  float r101 = texelFetch(densityAtlas, cell + ivec3(1, 0, 1), 0).r;
  float r011 = texelFetch(densityAtlas, cell + ivec3(0, 1, 1), 0).r;
  float r111 = texelFetch(densityAtlas, cell + ivec3(1, 1, 1), 0).r;
  return vec3(
    (r001 - r000) * e.x * e.y + (r101 - r100) * f.x * e.y + (r011 - r010) * e.x * f.y + (r111 - r110) * f.x * f.y,
    (r010 - r000) * e.x * e.z + (r110 - r100) * f.x * e.z + (r011 - r001) * e.x * f.z + (r111 - r101) * f.x * f.z,
    (r100 - r000) * e.y * e.z + (r110 - r010) * f.y * e.z + (r101 - r001) * e.y * f.z + (r111 - r011) * f.y * f.z
  ) * unit;
}

vec3 pullBack(vec3 slope, vec3 q) {
  return vec3(
    dot(slope, contractVelocity(q, vec3(1.0, 0.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 1.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 0.0, 1.0)))
  );
}
`,Be=`
// Rounded here, and put amid the step: some GPUs cut off where others round.
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec3 d = rotation * normalize(vec3((pixel - lens.zw) / lens.xy * vec2(1.0, -1.0), -1.0));
  vec3 go = (eye - lower) * scale;
  vec3 gd = d * scale;
  vec3 inverse_ = safeInverse(gd);
  float t = near;
  float end = 1e30;
#ifndef CONTRACTED
  vec3 lo = vec3(bricksOrigin);
  vec2 hit = slab(go, inverse_, lo, lo + 4.0 * vec3(bricksDims));
  t = max(hit.x, near) + 0.5 * marchStep;
  end = hit.y;
#endif
#ifdef EDITED
  vec2 edited = editedPart(eye, d);
#endif
  float T = 1.0;
  vec3 rgb = vec3(0.0);
  vec3 normal = vec3(0.0);
  float depth = 0.0;
#ifdef COUNT
  int samples = 0;
  int reads = 0;
#endif
  while (t < end && T > 1e-3) {
    vec3 g = go + t * gd;
    float h = marchStep;
    float leap = 0.0;
#ifdef CONTRACTED
    vec3 q = g;
    vec3 v = contractVelocity(q, gd) * halfGrid;
    g = (contract(q) + 2.0) * halfGrid;
    h = marchStep / max(max(abs(v.x), abs(v.y)), abs(v.z));
    float m = max(max(abs(q.x), abs(q.y)), abs(q.z));
    if (m > 2.0 * halfGrid.x) end = t;
    float run = emptyRun(g, safeInverse(v));
    if (run >= 0.0) {
      leap = m > 1.0 ? min(0.5 * run, 0.25 * m / max(max(abs(gd.x), abs(gd.y)), abs(gd.z))) : run;
      leap = max(leap, h);
    }
#else
    float run = emptyRun(g, inverse_);
    if (run >= 0.0) leap = (floor(run / marchStep) + 1.0) * marchStep;
#endif
#ifdef COUNT
    reads += 1;
#endif
    if (run >= 0.0) {
      t += leap;
      continue;
    }
    bool alive = true;
    bool moved = false;
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      bool emptied = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (emptied) alive = false;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, texel, corner)) {
      vec3 at = (texel + 0.5) * atlasScale;
      float raw = textureLod(densityAtlas, at, 0.0).r * unit;
#ifdef COUNT
      samples += 1;
      reads += 2;
#endif
      if (raw > 0.0) {
#ifdef EDITED
        if (moved && preserveOpacity) raw *= length(view);
#endif
        float keep = exp(-raw * h);
        float w = T * (1.0 - keep);
        T *= keep;
        if (w > 1e-4) {
          vec3 c = colourAt(at, view / max(length(view), 1e-20));
#ifdef COUNT
          reads += COLOURS;
#endif
          rgb += w * clamp(c, 0.0, 1.0);
          depth += w * t;
#ifdef NORMALS
          vec3 slope = densitySlope(texel, corner);
#ifdef CONTRACTED
          slope = pullBack(slope * halfGrid, MOVED_POINT) * scale;
#else
          slope *= scale;
#endif
#ifdef EDITED
          if (moved) slope = throughEdits(slope, eye + t * d);
#endif
          normal -= w * slope / max(length(slope), 1e-12);
#endif
        }
      }
    }
    t += h;
  }
  float opacity = 1.0 - T;
  outColour = eightBits(vec4(rgb + T * background, opacity));
#ifdef COUNT
  outDepth = uint(reads / 4) << 16 | uint(samples);
#else
  outDepth = floatBitsToUint(opacity > 1e-6 ? depth / opacity : intBitsToFloat(0x7f800000));
#endif
#ifdef NORMALS
  float size = length(normal);
  outNormal = eightBits(vec4(size > 1e-6 ? 0.5 + 0.5 * normal / size : vec3(0.5), opacity));
#endif
}
`;function ke(o,e){const{source:t,colours:r}=Le(o.K),s=[`#define BRICK ${e}`,`#define COLOURS ${r}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return o.contracted&&s.push("#define CONTRACTED"),o.edited&&s.push("#define EDITED"),o.normals&&s.push("#define NORMALS"),o.count&&s.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...s,Ce,t,o.edited?Re(o.edits):"",Be].join(`
`)}const G=`#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`,Pe=`#version 300 es
precision highp float;
uniform sampler2D picture;
uniform vec2 size;
out vec4 colour;
void main() { colour = vec4(texture(picture, gl_FragCoord.xy / size).rgb, 1.0); }`;function Q(o){return O(o,G,Pe)}function ee(o,e,t,r,s,n){o.bindFramebuffer(o.FRAMEBUFFER,n),o.viewport(0,0,r,s),o.useProgram(e.program),q(o),o.activeTexture(o.TEXTURE0),o.bindTexture(o.TEXTURE_2D,t),o.uniform1i(e.uniform("picture"),0),o.uniform2f(e.uniform("size"),r,s),o.drawArrays(o.TRIANGLES,0,3)}function q(o){for(const e of[o.BLEND,o.DEPTH_TEST,o.CULL_FACE,o.STENCIL_TEST,o.SCISSOR_TEST,o.DITHER])o.disable(e);o.colorMask(!0,!0,!0,!0),o.depthMask(!1)}function X(o){for(let e=15;e>=0;e--)o.activeTexture(o.TEXTURE0+e),o.bindTexture(o.TEXTURE_2D,null),o.bindTexture(o.TEXTURE_3D,null);o.bindVertexArray(null),o.bindFramebuffer(o.FRAMEBUFFER,null),o.useProgram(null)}class te{constructor(e){this.gl=e}width=1;height=1;textures=null;framebuffer=null;get colour(){return this.textures?.colour??null}get depth(){return this.textures?.depth??null}setSize(e,t){e===this.width&&t===this.height||(this.dispose(),this.width=e,this.height=t)}bind(e){const{gl:t}=this;if(this.textures&&e&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={colour:this.texture(t.RGBA8,t.LINEAR),depth:this.texture(t.R32UI,t.NEAREST),normals:e?this.texture(t.RGBA8,t.NEAREST):null},this.framebuffer=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer);const{colour:r,depth:s,normals:n}=this.textures;for(const[i,a]of[r,s,n].entries())a&&t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+i,t.TEXTURE_2D,a,0)}t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.drawBuffers([t.COLOR_ATTACHMENT0,t.COLOR_ATTACHMENT1,...e?[t.COLOR_ATTACHMENT2]:[]]),t.viewport(0,0,this.width,this.height)}read(e){const{gl:t,width:r,height:s}=this,n=new Uint8Array(4*r*s),i=e&&this.textures?.normals?new Uint8Array(4*r*s):null;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.pixelStorei(t.PACK_ALIGNMENT,1),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,r,s,t.RGBA,t.UNSIGNED_BYTE,n),i&&(t.readBuffer(t.COLOR_ATTACHMENT2),t.readPixels(0,0,r,s,t.RGBA,t.UNSIGNED_BYTE,i)),t.bindFramebuffer(t.FRAMEBUFFER,null);const a=this.readDepth();return{width:r,height:s,rgba:H(n,4*r),depth:a,normals:i&&H(i,4*r)}}readDepth(){const{gl:e,width:t,height:r}=this,s=new Uint32Array(t*r);if(e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.pixelStorei(e.PACK_ALIGNMENT,1),e.readBuffer(e.COLOR_ATTACHMENT1),e.getParameter(e.IMPLEMENTATION_COLOR_READ_FORMAT)===e.RED_INTEGER)e.readPixels(0,0,t,r,e.RED_INTEGER,e.UNSIGNED_INT,s);else{const n=new Uint32Array(4*t*r);e.readPixels(0,0,t,r,e.RGBA_INTEGER,e.UNSIGNED_INT,n);for(let i=0;i<s.length;i++)s[i]=n[4*i]}return e.bindFramebuffer(e.FRAMEBUFFER,null),H(new Float32Array(s.buffer),t)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const r of Object.values(t))e.deleteTexture(r);e.deleteFramebuffer(this.framebuffer),this.forget()}texture(e,t){const{gl:r}=this,s=r.createTexture();return r.bindTexture(r.TEXTURE_2D,s),r.texStorage2D(r.TEXTURE_2D,1,e,this.width,this.height),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MIN_FILTER,t),r.texParameteri(r.TEXTURE_2D,r.TEXTURE_MAG_FILTER,t),r.bindTexture(r.TEXTURE_2D,null),s}}function H(o,e){const t=o.length/e;for(let r=0;r<t>>1;r++){const[s,n]=[r*e,(t-1-r)*e],i=o.slice(s,s+e);o.copyWithin(s,n,n+e),o.set(i,n)}return o}const Ge=768*2**20;class re{constructor(e,t=Ge){this.gl=e,this.memory=t,this.targets=new te(e),this.vertices=e.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;compileTime=0;shown=null;onGpu=null;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shown?.level??null}get active(){return this.edited&&this.shown?.level.last?this.onGpu:null}get bytes(){return this.shown?.textures.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const r=++this.loading,s=()=>r===this.loading;let n=0;for await(const i of Ne(e,t.onArrival)){if(await this.take(i,s),!s())return;t.onLevel?.(++n,i.field.levels.length)}}async restore(){const{shown:e,onGpu:t}=this;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shown=this.onGpu=null,this.targets.forget();const r=++this.loading;e&&await this.take(e.level,()=>r===this.loading),this.setEdits(t?.edits??null)}setEdits(e){const{gl:t}=this;if(this.onGpu&&(t.deleteBuffer(this.onGpu.buffer),t.deleteTexture(this.onGpu.lattice),t.deleteTexture(this.onGpu.occupancy),this.onGpu=null),e===null||e.edits===0)return;if(e.rows.length>4*1024)throw new Error("more edits than the page's shader holds");const r=t.createBuffer();t.bindBuffer(t.UNIFORM_BUFFER,r),t.bufferData(t.UNIFORM_BUFFER,16*1024,t.STATIC_DRAW),t.bufferSubData(t.UNIFORM_BUFFER,0,e.rows),t.bindBuffer(t.UNIFORM_BUFFER,null),this.onGpu={edits:e,buffer:r,lattice:this.uploadLattice(e),occupancy:Z(t,e.occupancy)}}render(e={}){const{gl:t,shown:r,camera:s,active:n}=this;if(!r||!s||t.isContextLost())return!1;const{level:i,textures:a}=r,{width:c,height:l}=this.targets,u={K:i.header.steps.length,contracted:i.field.contracted,edited:n!==null,edits:n&&be(n.edits.edits),normals:e.normals??!1,count:e.count??!1},{program:h,uniform:d}=this.program(u,i.field.brick);this.targets.bind(u.normals),t.useProgram(h),t.bindVertexArray(this.vertices),q(t),this.setField(d,r),this.setView(d,s);let m=0;const f=(T,g,w)=>{t.activeTexture(t.TEXTURE0+m),t.bindTexture(g,w),t.uniform1i(d(T),m++)};f("densityAtlas",t.TEXTURE_3D,a.density),f("brickIndex",t.TEXTURE_3D,a.index),f("bricks",t.TEXTURE_3D,n?.occupancy??r.occupancy),a.colours.forEach((T,g)=>f(`colourAtlas${g}`,t.TEXTURE_3D,T)),n&&(f("lattice",t.TEXTURE_2D,n.lattice),t.uniform1i(d("editCount"),n.edits.edits),t.uniform1i(d("boxCount"),n.edits.boxes),t.uniform1i(d("preserveOpacity"),Number(n.edits.preserveOpacity)),t.uniformBlockBinding(h,t.getUniformBlockIndex(h,"Edits"),0),t.bindBufferBase(t.UNIFORM_BUFFER,0,n.buffer));const{first:p,count:y}=e.rows??{first:0,count:l};return t.enable(t.SCISSOR_TEST),t.scissor(0,p,c,y),t.drawArrays(t.TRIANGLES,0,3),t.disable(t.SCISSOR_TEST),X(t),!0}show(e,t,r=null){const{gl:s}=this;s.bindVertexArray(this.vertices),ee(s,this.cached("show",()=>Q(s)),this.targets.colour,e,t,r),X(s)}read(e=!1){return this.targets.read(e)}readDepth(){return this.targets.readDepth()}dispose(){this.loading++,this.setEdits(null),this.drop(),this.targets.dispose();for(const{program:e}of this.programs.values())this.gl.deleteProgram(e);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(e,t){const r=await Me(this.gl,e,this.memory,t);r!==null&&(this.drop(),this.shown={level:e,textures:r,occupancy:Z(this.gl,e.occupancy)})}drop(){this.shown&&(ze(this.gl,this.shown.textures),this.gl.deleteTexture(this.shown.occupancy),this.shown=null)}uploadLattice({lattice:e}){const{gl:t}=this,r=Math.max(1,Math.ceil(e.length/(3*2048))),s=new Uint16Array(3*2048*r);s.set(e),U(t);const n=t.createTexture();return t.bindTexture(t.TEXTURE_2D,n),t.texStorage2D(t.TEXTURE_2D,1,t.RGB16F,2048,r),k(t,t.TEXTURE_2D,t.NEAREST),t.texSubImage2D(t.TEXTURE_2D,0,0,0,2048,r,t.RGB,t.HALF_FLOAT,s),t.bindTexture(t.TEXTURE_2D,null),n}program(e,t){return this.cached(JSON.stringify([e,t]),()=>{const r=O(this.gl,G,ke(e,t));return this.compileTime=r.milliseconds,r})}cached(e,t){let r=this.programs.get(e);return r||(r=t(),this.programs.set(e,r)),r}setField(e,{level:t,textures:r}){const{gl:s,active:n}=this,{bounds:i,contracted:a}=t.field,{resolution:c,unit:l,steps:u}=t.header,{across:h,edge:d,dims:m}=r.layout,p=i[1].map((x,v)=>x-i[0][v]).map((x,v)=>a?2/x:(c[v]-1)/x),y=i[0].map((x,v)=>a?.5*(x+i[1][v]):x),{origin:T,dims:g}=n?.edits.occupancy??t.occupancy,w=this.step??t.field.step;s.uniform3f(e("atlasScale"),1/(h[0]*d),1/(h[1]*d),1/(h[2]*d)),s.uniform3i(e("indexDims"),...m),s.uniform3i(e("bricksOrigin"),...T),s.uniform3i(e("bricksDims"),...g),s.uniform3i(e("resolution"),...c),s.uniform3fv(e("lower"),y),s.uniform3fv(e("scale"),p),s.uniform3fv(e("halfGrid"),c.map(x=>(x-1)/4)),s.uniform1f(e("unit"),l),s.uniform1f(e("marchStep"),a?w:w/Math.max(...p)),s.uniform1fv(e("coefficientSteps"),u)}setView(e,t){const{gl:r}=this,{width:s,height:n}=this.targets,{c2w:i}=t,a=s/t.width,c=n/t.height;r.uniform3f(e("eye"),i[3],i[7],i[11]),r.uniformMatrix3fv(e("rotation"),!0,[i[0],i[1],i[2],i[4],i[5],i[6],i[8],i[9],i[10]]),r.uniform4f(e("lens"),t.fx*a,t.fy*c,t.cx*a,t.cy*c),r.uniform1f(e("height"),n),r.uniform1f(e("near"),this.near),r.uniform3f(e("background"),...this.background)}}async function se(o){const e=new P(o),{header:t,...r}=await Xe(e),s=await r.read("rows"),n=J(await r.read("lattice")),i=await r.read("occupancy");return{edits:t.edits,boxes:t.boxes,preserveOpacity:t.preserve_opacity,rows:s,lattice:n,occupancy:{origin:t.origin,dims:t.dims,codes:i}}}async function Xe(o){const e=await S.open(o,"cageedit",1);return{header:e.header,read:t=>e.read(t)}}const $e="cagespla",We=1,qe=256,R=8;function I(o){return 4*Math.ceil(3*((o+1)**2-1)/16)}async function*He(o,e,t){const r=new P(o,t);try{const s=await S.open(r,$e,We),{header:n}=s;e(n);let i=0;for(const[a,c]of n.levels.entries()){const l=c-i,u=async w=>await s.read(`${a}.${w}`),h=await s.read(`${a}.chunks`),d=Ve(h,await u("means"),l),m=await u("rotations"),f=await u("scales"),p=await u("opacities"),y=await u("colours"),T=je(d,M(m),M(f),M(p),M(y)),g=Ke(await u("sh"),l,n.degree);yield{header:n,first:i,count:l,last:a===n.levels.length-1,means:d,records:T,harmonics:g},i=c}}finally{r.cancel()}}function M(o){const e=o.length/2,t=new Uint16Array(e);for(let r=0;r<e;r++)t[r]=o[r]<<8|o[e+r];return t}function Ve(o,e,t){const r=e.length/(3*t),s=256**r-1,n=new Float32Array(3*t);for(let i=0;i<t;i++){const a=6*Math.floor(i/qe);for(let c=0;c<3;c++){let l=0;for(let h=0;h<r;h++)l=256*l+e[(3*h+c)*t+i];const u=o[a+c];n[3*i+c]=u+(o[a+3+c]-u)*l/s}}return n}function je(o,e,t,r,s){const n=r.length,i=new Uint32Array(o.buffer),a=new Uint32Array(R*n);for(let c=0;c<n;c++){const l=R*c;a[l]=i[3*c],a[l+1]=i[3*c+1],a[l+2]=i[3*c+2],a[l+3]=s[c]|s[n+c]<<16,a[l+4]=e[c]|e[n+c]<<16,a[l+5]=e[2*n+c]|r[c]<<16,a[l+6]=t[c]|t[n+c]<<16,a[l+7]=t[2*n+c]|s[2*n+c]<<16}return a}function Ke(o,e,t){const r=4*I(t),s=new Uint8Array(r*e),n=3*((t+1)**2-1);for(let i=0;i<n;i++)for(let a=0;a<e;a++)s[r*a+i]=o[e*i+a];return new Uint32Array(s.buffer)}const Ye="cagesped",Ze=1,oe=12;async function Je(o){const e=await S.open(new P(o),Ye,Ze),{count:t,changed:r}=e.header,s=await e.read("hidden"),n=new Uint8Array(t);for(let f=0;f<t;f++)n[f]=s[f>>3]>>(f&7)&1;const i=await e.read("sources"),a=await e.read("means"),c=await e.read("covariances"),l=M(await e.read("opacities")),u=M(await e.read("turns")),h=new Uint32Array(oe*r),[d,m]=[new Uint32Array(a.buffer),new Uint32Array(c.buffer)];for(let f=0;f<r;f++){const p=oe*f;for(let y=0;y<3;y++)h[p+y]=d[3*f+y];h[p+3]=i[f];for(let y=0;y<6;y++)h[p+4+y]=m[6*f+y];h[p+10]=u[f]|u[r+f]<<16,h[p+11]=u[2*r+f]|l[f]<<16}return{count:t,hidden:n,changed:r,means:a,records:h}}const E=2048,V=3,Qe=`
uniform usampler2D order;       // numbers of splats, from far to near
uniform uint count;             // of them
uniform usampler2D records, harmonics, changed;
uniform uint own;               // splats of the field; numbers from it on are changed ones
uniform vec3 eye;               // less the field's centre
uniform mat3 W;                 // rows: x right, y down, z forward
uniform vec2 focal, centre, size;
uniform vec4 limits;            // of (x, y) / z: low, high of x, of y
uniform float near, logLow, logStep, colourStep;

// Mean in pixels, x right and y down; A, k of the conic A (x + k y)^2 + D y^2.
layout(location = 0) out uvec4 place;
// D, opacity (0: not shown), distance, its slope along x.
layout(location = 1) out uvec4 shape;
// Colour, slope of the distance along y.
layout(location = 2) out uvec4 tint;

const float BLUR = 0.3, SLOPE_BLUR = 0.02, ALPHA_MIN = 1.0 / 255.0, LEAST_COMPENSATION = 0.005;

uvec4 texel(usampler2D from, uint n) { return texelFetch(from, ivec2(n % ${E}u, n / ${E}u), 0); }

// The quaternion (w, x, y, z as its y, z, w, x: xyz and w) of three numbers of 15 bits; see page_splats.encode_rotations.
vec4 rotation(uvec2 words) {
  uvec3 codes = uvec3(words.x & 65535u, words.x >> 16, words.y & 65535u);
  uint left = (codes.x >> 15) | (codes.y >> 15) << 1;
  vec3 c = (vec3(codes & 32767u) - 16384.0) / (16383.0 * sqrt(2.0));
  float most = sqrt(max(0.0, 1.0 - dot(c, c)));
  if (left == 0u) return vec4(c, most);
  if (left == 1u) return vec4(most, c.y, c.z, c.x);
  if (left == 2u) return vec4(c.y, most, c.z, c.x);
  return vec4(c.y, c.z, most, c.x);
}

vec3 rotated(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

mat3 cholesky(float xx, float xy, float xz, float yy, float yz, float zz) {
  float a = sqrt(max(xx, 1e-38));
  float b = xy / a, c = xz / a;
  float d = sqrt(max(yy - b * b, 0.0));
  float e = d > 1e-6 * a ? (yz - b * c) / d : 0.0;
  float f = sqrt(max(zz - c * c - e * e, 0.0));
  return mat3(a, b, c, 0.0, d, e, 0.0, 0.0, f);
}
`,et=`
void main() {
  place = shape = tint = uvec4(0u);
#ifdef NORMALS
  normal = uvec4(0u);
#endif
  ivec2 here = ivec2(gl_FragCoord.xy);
  if (uint(here.y * ${E} + here.x) >= count) return;
  uint splat = texelFetch(order, here, 0).r;
  uint source = splat;
  vec3 mean;
  mat3 F;
  float o;
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  if (splat < own) {
    uvec4 first = texel(records, 2u * splat), second = texel(records, 2u * splat + 1u);
    mean = uintBitsToFloat(first.xyz);
    o = float(second.y >> 16) / 65535.0;
    vec3 s = exp(logLow + logStep * vec3(second.z & 65535u, second.z >> 16, second.w & 65535u));
    vec4 q = rotation(second.xy);
    F = mat3(s.x * rotated(q, vec3(1, 0, 0)), s.y * rotated(q, vec3(0, 1, 0)), s.z * rotated(q, vec3(0, 0, 1)));
  } else {
    uint n = 3u * (splat - own);
    uvec4 first = texel(changed, n), second = texel(changed, n + 1u), third = texel(changed, n + 2u);
    mean = uintBitsToFloat(first.xyz);
    source = first.w;
    vec4 C = uintBitsToFloat(second);
    F = cholesky(C.x, C.y, C.z, C.w, uintBitsToFloat(third.x), uintBitsToFloat(third.y));
    turn = rotation(third.zw);
    o = float(third.w >> 16) / 65535.0;
  }
  vec3 offset = mean - eye;
  vec3 p = W * offset;
  if (p.z < near || o <= ALPHA_MIN) return;
  vec2 n = clamp(p.xy / p.z, limits.xz, limits.yw);
  vec3 rowX = vec3(W[0].x, W[1].x, W[2].x), rowY = vec3(W[0].y, W[1].y, W[2].y), rowZ = vec3(W[0].z, W[1].z, W[2].z);
  vec3 N0 = (focal.x / p.z * (rowX - n.x * rowZ)) * F;
  vec3 N1 = (focal.y / p.z * (rowY - n.y * rowZ)) * F;
  float a = dot(N0, N0), b = dot(N0, N1), c = dot(N1, N1);
  vec3 area = cross(N0, N1);
  float sharp = dot(area, area);
  float det = sharp + BLUR * (a + c + BLUR);
  float slopeDet = sharp + SLOPE_BLUR * (a + c + SLOPE_BLUR);
#ifdef ANTIALIASED
  o *= max(LEAST_COMPENSATION, sqrt(sharp / det));
#endif
  float reach = 2.0 * log(o / ALPHA_MIN);
  if (!(reach > 0.0)) return;
  vec2 at = p.xy / p.z * focal + centre;
  vec2 extent = sqrt(reach * (vec2(a, c) + BLUR));
  if (any(lessThanEqual(at + extent, vec2(0.0))) || any(greaterThanEqual(at - extent, size))) return;
  place = floatBitsToUint(vec4(at, (c + BLUR) / det, -b / (c + BLUR)));
  float distance = length(offset);
  vec3 d = offset / distance;
  vec3 along = d * F;
  float alongU = dot(along, N0), alongV = dot(along, N1);
  vec2 slope = vec2(alongU * (c + SLOPE_BLUR) - alongV * b, alongV * (a + SLOPE_BLUR) - alongU * b) / slopeDet;
  shape = floatBitsToUint(vec4(1.0 / (c + BLUR), o, distance, slope.x));
#ifdef NORMALS
  vec3 axis = flattest(F);
  normal = floatBitsToUint(vec4(dot(axis, d) > 0.0 ? -axis : axis, 0.0));
#endif
  d = rotated(vec4(-turn.xyz, turn.w), d);
  tint = floatBitsToUint(vec4(max(colourOf(source, d), 0.0), slope.y));
}
`,tt=`
layout(location = 3) out uvec4 normal;
vec3 flattest(mat3 F) {
  mat3 C = F * transpose(F);
  mat3 B = mat3(cross(C[1], C[2]), cross(C[2], C[0]), cross(C[0], C[1]));
  for (int n = 0; n < 8; n++) {
    B /= max(B[0][0] + B[1][1] + B[2][2], 1e-37);
    B = B * B;
  }
  vec3 length2 = vec3(dot(B[0], B[0]), dot(B[1], B[1]), dot(B[2], B[2]));
  vec3 axis = length2.x >= length2.y && length2.x >= length2.z ? B[0] : length2.y >= length2.z ? B[1] : B[2];
  return axis / max(length(axis), 1e-37);
}
`;function rt(o){const e=I(o)/4,t=(o+1)**2,r=[...o>0?[`uniform float steps[${t-1}];`]:[],"vec3 colourOf(uint splat, vec3 d) {","  uvec2 last = texel(records, 2u * splat + 1u).zw;","  uint both = texel(records, 2u * splat).w;",`  vec3 rgb = 0.5 + ${W[0]} * colourStep * (vec3(both & 65535u, both >> 16, last.y >> 16) - 32768.0);`,...Array.from({length:e},(s,n)=>`  uvec4 t${n} = texel(harmonics, ${e}u * splat + ${n}u);`)];for(let s=1;s<t;s++){const n=[0,1,2].map(i=>{const a=3*(s-1)+i;return`(t${a>>4}.${"xyzw"[a>>2&3]} >> ${8*(a&3)} & 255u)`});r.push(`  rgb += (steps[${s-1}] * (${W[s]})) * (vec3(${n.join(", ")}) - 128.0);`)}return[...r,"  return rgb;","}"].join(`
`)}function st(o){return["#version 300 es","precision highp float;","precision highp int;","precision highp usampler2D;",...o.antialiased?["#define ANTIALIASED"]:[],...o.normals?["#define NORMALS"]:[],Qe,o.normals?tt:"",rt(o.degree),et].join(`
`)}const ot=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D places, shapes, tints;
uniform vec2 size;
flat out vec4 where;
flat out vec4 how;
flat out vec4 colour;
#ifdef NORMALS
uniform usampler2D normals;
flat out vec3 axis;
#endif
void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  int splat = gl_VertexID / 6, side = gl_VertexID - 6 * splat;
  ivec2 here = ivec2(splat % ${E}, splat / ${E});
  how = uintBitsToFloat(texelFetch(shapes, here, 0));
  if (how.y <= 0.0) return;
  where = uintBitsToFloat(texelFetch(places, here, 0));
  colour = uintBitsToFloat(texelFetch(tints, here, 0));
#ifdef NORMALS
  axis = uintBitsToFloat(texelFetch(normals, here, 0)).xyz;
#endif
  float reach = 2.0 * log(255.0 * how.y);
  // Two triangles: corners 0 1 2 and 3 2 1.
  int number = side < 3 ? side : 6 - side;
  vec2 corner = vec2(float(number & 1), float(number >> 1)) * 2.0 - 1.0;
  vec2 at = corner * (sqrt(reach / vec2(where.z, how.x)) + 0.01);
  at = where.xy + vec2(at.x - where.w * at.y, at.y);
  gl_Position = vec4(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, 0.0, 1.0);
}`,nt=`#version 300 es
precision highp float;
flat in vec4 where;
flat in vec4 how;
flat in vec4 colour;
uniform vec2 size;
uniform float unit;                 // of distances
layout(location = 0) out vec4 outColour;
layout(location = 1) out vec4 outDepth;
#ifdef NORMALS
flat in vec3 axis;
layout(location = 2) out vec4 outNormal;
#endif
void main() {
  vec2 d = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - where.xy;
  float l = d.x + where.w * d.y;
  float q = where.z * l * l + how.x * d.y * d.y;
  float a = min(how.y * exp(-0.5 * q), 0.99);
  if (a < 1.0 / 255.0) discard;
  outColour = vec4(a * colour.rgb, a);
  outDepth = vec4(a * unit * (how.z + how.w * d.x + colour.w * d.y), 0.0, 0.0, a);
#ifdef NORMALS
  outNormal = vec4(a * (0.5 + 0.5 * axis), a);
#endif
}`,it=`#version 300 es
precision highp float;
precision highp int;
uniform sampler2D gathered, distances;
uniform vec3 background;
uniform float unit;
layout(location = 0) out vec4 outColour;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
uniform sampler2D axes;
layout(location = 2) out vec4 outNormal;
#endif
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(gathered, at, 0);
  outColour = eightBits(vec4(sum.rgb + (1.0 - sum.a) * background, sum.a));
  float distance = texelFetch(distances, at, 0).r / unit;
  outDepth = floatBitsToUint(sum.a > 1e-6 ? distance / sum.a : intBitsToFloat(0x7f800000));
#ifdef NORMALS
  vec4 both = texelFetch(axes, at, 0);
  vec3 normal = 2.0 * both.rgb - both.a;
  float length_ = length(normal);
  outNormal = eightBits(vec4(length_ > 1e-3 ? 0.5 + 0.5 * normal / length_ : vec3(0.5), sum.a));
#endif
}`;function j(o,e){const t=o.indexOf(`
`)+1;return o.slice(0,t)+e.map(r=>`#define ${r}
`).join("")+o.slice(t)}function ne(o){const e=o.getExtension("EXT_color_buffer_float");return e&&o.getExtension("EXT_float_blend")?{colour:o.RGBA16F,distance:o.R32F,isByte:!1}:e??o.getExtension("EXT_color_buffer_half_float")?{colour:o.RGBA16F,distance:o.RGBA16F,isByte:!1}:{colour:o.RGBA8,distance:o.RGBA8,isByte:!0}}class ie{constructor(e,t){this.gl=e,this.formats=t}textures=null;framebuffer=null;width=0;height=0;begin(e,t,r){const{gl:s,formats:n}=this;if(this.textures&&(e!==this.width||t!==this.height||r&&!this.textures.normal)&&this.dispose(),!this.textures){this.width=e,this.height=t,this.textures={colour:this.texture(n.colour),distance:this.texture(n.distance),normal:r?this.texture(n.colour):null},this.framebuffer=s.createFramebuffer(),s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer);const{colour:i,distance:a,normal:c}=this.textures;for(const[l,u]of[i,a,c].entries())u&&s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0+l,s.TEXTURE_2D,u,0)}s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer),s.drawBuffers([s.COLOR_ATTACHMENT0,s.COLOR_ATTACHMENT1,...r?[s.COLOR_ATTACHMENT2]:[]]),s.viewport(0,0,e,t);for(let i=0;i<(r?3:2);i++)s.clearBufferfv(s.COLOR,i,[0,0,0,0])}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:e,textures:t}=this;if(t)for(const r of Object.values(t))e.deleteTexture(r);e.deleteFramebuffer(this.framebuffer),this.forget()}texture(e){const{gl:t}=this,r=t.createTexture();return t.bindTexture(t.TEXTURE_2D,r),t.texStorage2D(t.TEXTURE_2D,1,e,this.width,this.height),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.NEAREST),t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MAG_FILTER,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),r}}class ae{constructor(e){this.gl=e}order=null;outputs=[];framebuffer=null;rows=0;reserve(e,t){const{gl:r}=this,s=Math.ceil(e/E),n=V+(t?1:0);if(s<=this.rows&&n<=this.outputs.length)return!1;const i=Math.max(n,this.outputs.length);this.rows=Math.max(s,this.rows),this.drop(),this.order=this.texture(r.R32UI),this.outputs=Array.from({length:i},()=>this.texture(r.RGBA32UI)),this.framebuffer=r.createFramebuffer(),r.bindFramebuffer(r.FRAMEBUFFER,this.framebuffer);for(const[a,c]of this.outputs.entries())r.framebufferTexture2D(r.FRAMEBUFFER,r.COLOR_ATTACHMENT0+a,r.TEXTURE_2D,c,0);return!0}put(e){const{gl:t}=this,r=Math.floor(e.length/E),s=e.length-r*E;U(t),t.bindTexture(t.TEXTURE_2D,this.order),t.texSubImage2D(t.TEXTURE_2D,0,0,0,E,r,t.RED_INTEGER,t.UNSIGNED_INT,e),s>0&&t.texSubImage2D(t.TEXTURE_2D,0,0,r,s,1,t.RED_INTEGER,t.UNSIGNED_INT,e,r*E),t.bindTexture(t.TEXTURE_2D,null)}bind(e,t){const{gl:r}=this;r.bindFramebuffer(r.FRAMEBUFFER,this.framebuffer),r.drawBuffers(this.outputs.map((s,n)=>n<V||t?r.COLOR_ATTACHMENT0+n:r.NONE)),r.viewport(0,0,E,Math.ceil(e/E))}dispose(){this.drop(),this.rows=0}drop(){const{gl:e}=this;for(const t of[this.order,...this.outputs])e.deleteTexture(t);e.deleteFramebuffer(this.framebuffer),this.order=this.framebuffer=null,this.outputs=[]}texture(e){const{gl:t}=this,r=t.createTexture();return t.bindTexture(t.TEXTURE_2D,r),t.texStorage2D(t.TEXTURE_2D,1,e,E,this.rows),k(t,t.TEXTURE_2D,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),r}}const K=65536;function at(o,e){const{means:t,hidden:r,changed:s}=o,[n,i,a]=e.axis,{offset:c,near:l}=e,u=t.length/3,h=u+(s?s.length/3:0),d=new Float32Array(h),m=new Uint32Array(d.buffer),f=new Uint32Array(h);let p=0;for(let x=0;x<u;x++){if(r!==null&&r[x]===1)continue;const v=n*t[3*x]+i*t[3*x+1]+a*t[3*x+2]+c;v<l||(d[p]=v,f[p++]=x)}if(s!==null)for(let x=u;x<h;x++){const v=3*(x-u),ge=n*s[v]+i*s[v+1]+a*s[v+2]+c;ge<l||(d[p]=ge,f[p++]=x)}const y=new Uint32Array(K),T=new Uint32Array(p),g=new Uint32Array(p);for(let x=0;x<p;x++)y[m[x]&65535]++;let w=0;for(let x=K-1;x>=0;x--){const v=y[x];y[x]=w,w+=v}for(let x=p-1;x>=0;x--)T[y[m[x]&65535]++]=x;y.fill(0);for(let x=0;x<p;x++)y[m[x]>>>16]++;w=0;for(let x=K-1;x>=0;x--){const v=y[x];y[x]=w,w+=v}for(let x=0;x<p;x++){const v=T[x];g[y[m[v]>>>16]++]=f[v]}return g}const ce=`(function(){"use strict";function R(s,c){const{means:f,hidden:h,changed:r}=s,[d,U,b]=c.axis,{offset:g,near:m}=c,i=f.length/3,A=i+(r?r.length/3:0),w=new Float32Array(A),u=new Uint32Array(w.buffer),y=new Uint32Array(A);let e=0;for(let n=0;n<i;n++){if(h!==null&&h[n]===1)continue;const t=d*f[3*n]+U*f[3*n+1]+b*f[3*n+2]+g;t<m||(w[e]=t,y[e++]=n)}if(r!==null)for(let n=i;n<A;n++){const t=3*(n-i),I=d*r[t]+U*r[t+1]+b*r[t+2]+g;I<m||(w[e]=I,y[e++]=n)}const o=new Uint32Array(65536),p=new Uint32Array(e),D=new Uint32Array(e);for(let n=0;n<e;n++)o[u[n]&65535]++;let l=0;for(let n=65535;n>=0;n--){const t=o[n];o[n]=l,l+=t}for(let n=e-1;n>=0;n--)p[o[u[n]&65535]++]=n;o.fill(0);for(let n=0;n<e;n++)o[u[n]>>>16]++;l=0;for(let n=65535;n>=0;n--){const t=o[n];o[n]=l,l+=t}for(let n=0;n<e;n++){const t=p[n];D[o[u[t]>>>16]++]=y[t]}return D}let a=null;self.onmessage=({data:s})=>{if("set"in s){a=s.set;return}const c=a?R(a,s.sort):new Uint32Array(0);self.postMessage(c,{transfer:[c.buffer]})}})();
`,le=typeof self<"u"&&self.Blob&&new Blob([ce],{type:"text/javascript;charset=utf-8"});function ct(o){let e;try{if(e=le&&(self.URL||self.webkitURL).createObjectURL(le),!e)throw"";const t=new Worker(e,{name:o?.name});return t.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(e)}),t}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent(ce),{name:o?.name})}finally{e&&(self.URL||self.webkitURL).revokeObjectURL(e)}}const lt=32768;class ht{onOrder=null;order=null;worker=null;posted=null;sorting=null;next=null;outdated=!1;of(e,t,r){const{order:s}=this,n=s?.set===e?s:null;return n!==null&&he(n.depths,t)?n:n===null||r||e.means.length<=3*lt?(this.next=null,this.outdated=this.sorting!==null,this.order={numbers:at(e,t),set:e,depths:t}):(this.ask(e,t),n)}dispose(){this.worker?.terminate(),this.worker=this.posted=this.sorting=this.next=this.order=null}ask(e,t){if(this.sorting!==null&&he(this.sorting,t)&&this.posted===e){this.next=null;return}this.next=t,this.sorting===null&&(this.worker??=this.begun(),this.posted!==e&&(this.worker.postMessage({set:e}),this.posted=e),this.sorting=this.next,this.next=null,this.worker.postMessage({sort:this.sorting}))}begun(){const e=new ct;return e.onmessage=({data:t})=>{const{sorting:r,posted:s,order:n,next:i,outdated:a}=this;this.sorting=null,this.outdated=!1,!(r===null||s===null||n?.set!==s||a)&&(this.order={numbers:t,set:s,depths:r},i&&this.ask(s,i),this.onOrder?.())},e}}function he(o,e){return o.offset===e.offset&&o.near===e.near&&o.axis.every((t,r)=>t===e.axis[r])}const ue=128;class N{constructor(e,t){this.gl=e,this.rows=Math.max(1,Math.ceil(t/(4*E)));const r=e.getParameter(e.MAX_TEXTURE_SIZE);if(this.rows>r)throw new C(`the splats take ${this.rows} rows of a texture, more than the ${r} that the GPU has`);for(;e.getError()!==e.NO_ERROR;);if(this.texture=e.createTexture(),e.bindTexture(e.TEXTURE_2D,this.texture),e.texStorage2D(e.TEXTURE_2D,1,e.RGBA32UI,E,this.rows),k(e,e.TEXTURE_2D,e.NEAREST),e.bindTexture(e.TEXTURE_2D,null),e.getError()===e.OUT_OF_MEMORY)throw this.dispose(),new Error("the GPU has not enough memory for the splats")}texture;rows;stride=4*E;async put(e,t,r,s){const{stride:n}=this;for(let i=Math.floor(t/n);i*n<r;i+=ue){if(i*n>t&&await new Promise(a=>setTimeout(a)),!s())return;this.putRows(e,i,Math.min(i+ue,Math.ceil(r/n)))}}putRows(e,t,r){const{gl:s,stride:n}=this;let i=e.subarray(t*n,r*n);if(i.length<(r-t)*n){const a=new Uint32Array((r-t)*n);a.set(i),i=a}U(s),s.bindTexture(s.TEXTURE_2D,this.texture),s.texSubImage2D(s.TEXTURE_2D,0,0,t,E,r-t,s.RGBA_INTEGER,s.UNSIGNED_INT,i),s.bindTexture(s.TEXTURE_2D,null)}dispose(){this.gl.deleteTexture(this.texture)}}const ut=16*(V+1)+4;class dt{constructor(e,t,r){this.gl=e,this.header=t;const{count:s,degree:n}=t,i=I(n);if(this.bytes=(4*(R+i)+ut)*s,this.bytes>r)throw new C(`the splats take ${Math.ceil(this.bytes/2**20)} MiB of the GPU, more than the ${Math.floor(r/2**20)} allowed`);this.means=new Float32Array(3*s),this.words=new Uint32Array(R*s),this.harmonicWords=new Uint32Array(i*s),this.set={means:this.means.subarray(0,0),hidden:null,changed:null},this.records=new N(e,this.words.length),this.harmonics=new N(e,this.harmonicWords.length)}set;records;harmonics;bytes;means;words;harmonicWords;get count(){return this.set.means.length/3}get isWhole(){return this.count===this.header.count}async take(e,t){this.means.set(e.means,3*e.first),this.words.set(e.records,R*e.first),this.harmonicWords.set(e.harmonics,I(e.header.degree)*e.first),await this.upload(e.first,e.first+e.count,t)}async restore(e){const{count:t}=this;this.records=new N(this.gl,this.words.length),this.harmonics=new N(this.gl,this.harmonicWords.length),this.set={...this.set,means:this.means.subarray(0,0)},await this.upload(0,t,e)}dispose(){this.records.dispose(),this.harmonics.dispose()}async upload(e,t,r){const s=I(this.header.degree);await this.records.put(this.words,R*e,R*t,r),r()&&await this.harmonics.put(this.harmonicWords,s*e,s*t,r),r()&&(this.set={means:this.means.subarray(0,3*t),hidden:null,changed:null})}}const ft=768*2**20,de=.3;class xt{constructor(e,t=ft,r=null){this.gl=e,this.memory=t,this.targets=new te(e),this.vertices=e.createVertexArray(),this.formats=r??ne(e),this.gathering=new ie(e,this.formats),this.projection=new ae(e)}background=[1,1,1];near=0;edited=!0;targets;compileTime=0;sorter=new ht;formats;gathering;store=null;changed=null;camera=null;loading=0;programs=new Map;projection;vertices;ordered=null;set onOrder(e){this.sorter.onOrder=e}get fileBackground(){return this.store?.header.background??null}get count(){return this.store?.count??0}get bytes(){return this.store?.bytes??0}setSize(e,t){this.targets.setSize(e,t)}setCamera(e){this.camera=e}async load(e,t={}){const r=++this.loading,s=()=>r===this.loading;let n=0,i=null;const a=c=>{s()&&(i=new dt(this.gl,c,this.memory))};try{for await(const c of He(e,a,t.onArrival)){const l=i;if(!s()||l===null||(await l.take(c,s),!s()))return;this.store!==l&&(this.store?.dispose(),this.store=l,this.ordered=null),t.onLevel?.(++n,c.header.levels.length)}}finally{const c=i;c!==null&&this.store!==c&&c.dispose()}}async restore(){const{gl:e,store:t,changed:r}=this;this.programs.clear(),this.vertices=e.createVertexArray(),this.ordered=this.changed=null,this.projection=new ae(e),this.targets.forget(),this.gathering=new ie(e,ne(e));const s=++this.loading;await t?.restore(()=>s===this.loading),this.setEdits(r?.edits??null)}setEdits(e){if(this.changed?.texture.dispose(),this.changed=null,e===null)return;if(this.store!==null&&e.count!==this.store.header.count)throw new Error(`edits of ${e.count} splats, the page has ${this.store.header.count}; reload it`);const t=new N(this.gl,e.records.length);e.changed>0&&t.putRows(e.records,0,Math.ceil(e.records.length/t.stride)),this.changed={edits:e,texture:t,set:null}}render(e={}){const{gl:t,store:r,camera:s,gathering:n}=this;if(!r||r.count===0||!s||t.isContextLost())return!1;const{width:i,height:a}=this.targets,c=e.normals??!1,l=this.sorter.of(this.shown(r),this.depths(r,s),e.sorted??!1);q(t);const u=this.project(r,s,l,c),{first:h,count:d}=e.rows??{first:0,count:a};n.begin(i,a,c),t.enable(t.SCISSOR_TEST),t.scissor(0,h,i,d);const m=n.formats.isByte?1/this.farthest(r,s):1;return u>0&&this.blend(u,c,m),this.resolve(c,m),t.disable(t.SCISSOR_TEST),X(t),!0}show(e,t,r=null){this.gl.bindVertexArray(this.vertices),ee(this.gl,this.cached("show",()=>Q(this.gl)),this.targets.colour,e,t,r),X(this.gl)}read(e=!1){return this.targets.read(e)}readDepth(){return this.targets.readDepth()}dispose(){const{gl:e}=this;this.loading++,this.setEdits(null),this.store?.dispose(),this.store=this.ordered=null,this.sorter.dispose(),this.targets.dispose(),this.gathering.dispose(),this.projection.dispose();for(const{program:t}of this.programs.values())e.deleteProgram(t);this.programs.clear(),e.deleteVertexArray(this.vertices)}shown(e){const{changed:t}=this;return!this.edited||t===null||!e.isWhole?e.set:(t.set??={means:e.set.means,hidden:t.edits.hidden,changed:t.edits.means},t.set)}eye(e,{c2w:t}){const{centre:r}=e.header;return[t[3]-r[0],t[7]-r[1],t[11]-r[2]]}depths(e,t){const{c2w:r}=t,[s,n,i]=this.eye(e,t),a=[-r[2],-r[6],-r[10]];return{axis:a,offset:-(a[0]*s+a[1]*n+a[2]*i),near:Math.max(this.near,e.header.near)}}farthest(e,t){const[r,s]=e.header.bounds;return Math.hypot(...this.eye(e,t))+Math.hypot(...s.map((n,i)=>n-r[i]))}project(e,t,r,s){const{gl:n}=this,{degree:i,antialiased:a,steps:c,log_scales:l,colour_step:u}=e.header,h=r.numbers.length;if(h===0)return 0;const{program:d,uniform:m}=this.cached(`project${i}${a}${s}`,()=>{const p=O(n,G,st({degree:i,antialiased:a,normals:s}));return this.compileTime=p.milliseconds,p}),{projection:f}=this;return(f.reserve(h,s)||this.ordered!==r)&&f.put(r.numbers),this.ordered=r,f.bind(h,s),n.useProgram(d),n.bindVertexArray(this.vertices),this.setView(m,e,t),i>0&&n.uniform1fv(m("steps"),c),n.uniform1ui(m("own"),e.count),n.uniform1f(m("logLow"),l[0]),n.uniform1f(m("logStep"),(l[1]-l[0])/65535),n.uniform1f(m("colourStep"),u),n.uniform1ui(m("count"),h),this.bind(m,"order",f.order,0),this.bind(m,"records",e.records.texture,1),this.bind(m,"harmonics",e.harmonics.texture,2),this.bind(m,"changed",(this.changed?.texture??e.records).texture,3),n.drawArrays(n.TRIANGLES,0,3),h}blend(e,t,r){const{gl:s}=this,n=t?["NORMALS"]:[],{program:i,uniform:a}=this.cached(`blend${t}`,()=>O(s,j(ot,n),j(nt,n)));s.useProgram(i),s.bindVertexArray(this.vertices),["places","shapes","tints",...t?["normals"]:[]].forEach((l,u)=>this.bind(a,l,this.projection.outputs[u],u)),s.uniform2f(a("size"),this.targets.width,this.targets.height),s.uniform1f(a("unit"),r),s.enable(s.BLEND),s.blendEquation(s.FUNC_ADD),s.blendFunc(s.ONE,s.ONE_MINUS_SRC_ALPHA),s.drawArrays(s.TRIANGLES,0,6*e),s.disable(s.BLEND)}resolve(e,t){const{gl:r}=this,{program:s,uniform:n}=this.cached(`resolve${e}`,()=>O(r,G,j(it,e?["NORMALS"]:[])));this.targets.bind(e),r.useProgram(s),r.bindVertexArray(this.vertices);const{colour:i,distance:a,normal:c}=this.gathering.textures;this.bind(n,"gathered",i,0),this.bind(n,"distances",a,1),c&&e&&this.bind(n,"axes",c,2),r.uniform3f(n("background"),...this.background),r.uniform1f(n("unit"),t),r.drawArrays(r.TRIANGLES,0,3)}bind(e,t,r,s){const{gl:n}=this;n.activeTexture(n.TEXTURE0+s),n.bindTexture(n.TEXTURE_2D,r),n.uniform1i(e(t),s)}setView(e,t,r){const{gl:s}=this,{width:n,height:i}=this.targets,{c2w:a}=r,[c,l]=[r.fx,r.cx].map(p=>p*n/r.width),[u,h]=[r.fy,r.cy].map(p=>p*i/r.height),[d,m]=[.5*de*n/c,.5*de*i/u];s.uniform3f(e("eye"),...this.eye(t,r));const f=[a[0],-a[1],-a[2],a[4],-a[5],-a[6],a[8],-a[9],-a[10]];s.uniformMatrix3fv(e("W"),!1,f),s.uniform2f(e("focal"),c,u),s.uniform2f(e("centre"),l,h),s.uniform2f(e("size"),n,i),s.uniform4f(e("limits"),-l/c-d,(n-l)/c+d,-h/u-m,(i-h)/u+m),s.uniform1f(e("near"),Math.max(this.near,t.header.near))}cached(e,t){let r=this.programs.get(e);return r||(r=t(),this.programs.set(e,r)),r}}const Y=[1,.75,.5,.35,.25,.18,.12];class mt{constructor(e=28,t=40){this.moving=e,this.part=t}cost=null;took(e,t){const r=t/Math.max(1,e);this.cost=this.cost===null?r:this.cost+.3*(r-this.cost)}scale(e,t){const{cost:r}=this;return r===null?.25:Y.find(s=>r*e*t*s*s<=this.moving)??Y[Y.length-1]}rows(e,t){return this.cost===null?16:Math.max(4,Math.min(t,Math.floor(this.part/Math.max(1e-9,this.cost*e))))}}async function pt(o){const e=performance.now(),t=o.fenceSync(o.SYNC_GPU_COMMANDS_COMPLETE,0);if(o.flush(),t===null)return 0;for(;!o.isContextLost()&&o.clientWaitSync(t,0,0)===o.TIMEOUT_EXPIRED;)await new Promise(r=>setTimeout(r,1));return o.deleteSync(t),performance.now()-e}function yt(o,e){const t=new Map;o.style.touchAction="none",o.addEventListener("contextmenu",r=>r.preventDefault()),o.addEventListener("pointerdown",r=>{o.setPointerCapture(r.pointerId),t.set(r.pointerId,{x:r.clientX,y:r.clientY,shifts:r.button!==0||r.shiftKey})});for(const r of["pointerup","pointercancel"])o.addEventListener(r,s=>t.delete(s.pointerId));o.addEventListener("pointermove",r=>{const s=t.get(r.pointerId);if(!s)return;const[n,i]=[r.clientX-s.x,r.clientY-s.y],a=[...t.entries()].find(([c])=>c!==r.pointerId)?.[1];if(a){const c=Math.hypot(s.x-a.x,s.y-a.y),l=Math.hypot(r.clientX-a.x,r.clientY-a.y);e.shift(n/2,i/2),c>1&&l>1&&e.zoom(c/l)}else s.shifts?e.shift(n,i):e.turn(n,i);s.x=r.clientX,s.y=r.clientY}),o.addEventListener("wheel",r=>{r.preventDefault();const s=r.deltaMode===WheelEvent.DOM_DELTA_LINE?30:1;e.zoom(Math.exp(.0012*s*r.deltaY))},{passive:!1})}const b=(o,e,t=1)=>[o[0]+t*e[0],o[1]+t*e[1],o[2]+t*e[2]],A=(o,e)=>b(o,e,-1),$=(o,e)=>[e*o[0],e*o[1],e*o[2]],z=(o,e)=>o[0]*e[0]+o[1]*e[1]+o[2]*e[2],F=(o,e)=>[o[1]*e[2]-o[2]*e[1],o[2]*e[0]-o[0]*e[2],o[0]*e[1]-o[1]*e[0]],fe=o=>Math.hypot(...o),D=o=>$(o,1/Math.max(1e-30,fe(o)));function xe(o,e,t){const[r,s]=[Math.cos(t),Math.sin(t)];return b(b($(o,r),F(e,o),s),e,z(e,o)*(1-r))}const _=(o,e)=>[o[e],o[4+e],o[8+e]];function me(o,e,t,r){return[0,1,2].flatMap(s=>[o[s],e[s],t[s],r[s]]).concat(0,0,0,1)}const pe=.02;class ye{constructor(e,t,r){this.up=t,this.eye=_(e,3);const s=$(_(e,2),-1);this.target=b(this.eye,s,Math.max(z(A(r,this.eye),s),.001))}eye;target;get c2w(){const e=D(A(this.eye,this.target)),t=D(F(this.up,e));return me(t,F(e,t),e,this.eye)}turn(e,t){const r=xe(A(this.eye,this.target),this.up,-e),s=D(F(this.up,r)),n=Math.acos(Math.max(-1,Math.min(1,z(D(r),this.up)))),i=Math.max(pe,Math.min(Math.PI-pe,n-t))-n;this.eye=b(this.target,xe(r,s,i))}shift(e,t,r){const s=2*r*fe(A(this.eye,this.target)),{c2w:n}=this,i=b($(_(n,0),-e*s),_(n,1),t*s);this.eye=b(this.eye,i),this.target=b(this.target,i)}zoom(e){this.eye=b(this.target,A(this.eye,this.target),e)}}function wt({stills:o,seconds:e,loop:t},r){const s=e>0?r/e:1,n=o.length-1,i=t?s%1*o.length:Math.min(s,1)*n,a=o[Math.min(Math.floor(i),n)],c=o[t?(Math.floor(i)+1)%o.length:Math.min(Math.floor(i)+1,n)],l=i-Math.floor(i),u=f=>b(_(a.c2w,f),A(_(c.c2w,f),_(a.c2w,f)),l),h=D(u(2)),d=u(1),m=D(A(d,[h[0]*z(d,h),h[1]*z(d,h),h[2]*z(d,h)]));return{c2w:me(F(m,h),m,h,u(3)),fov_y_deg:a.fov_y_deg+l*(c.fov_y_deg-a.fov_y_deg)}}const vt=120,gt=2;class Et{constructor(e,t,r){this.canvas=e,this.header=t,this.say=r;const s=e.getContext("webgl2",{alpha:!1,antialias:!1,depth:!1,powerPreference:"high-performance"});if(!s)throw new Error("This browser has no WebGL2, which the scene is drawn with.");this.gl=s,this.renderer=new re(s),this.renderer.background=t.background??[1,1,1],this.orbit=new ye(t.start.c2w,t.up,t.centre),this.fov=t.start.fov_y_deg,yt(e,{turn:(n,i)=>this.change(()=>this.orbit.turn(Math.PI*n/e.clientHeight,Math.PI*i/e.clientHeight)),shift:(n,i)=>this.change(()=>this.orbit.shift(n/e.clientHeight,i/e.clientHeight,this.tangent)),zoom:n=>this.change(()=>this.orbit.zoom(n))}),e.addEventListener("webglcontextlost",n=>n.preventDefault()),e.addEventListener("webglcontextrestored",()=>void this.renderer.restore().then(()=>this.touch())),new ResizeObserver(()=>this.touch()).observe(e)}renderer;orbit;gl;pacing=new mt;fov;moved=performance.now();row=0;playing=null;async run(e,t){t&&this.renderer.setEdits(await se(t)),this.draw(),await this.renderer.load(e,{onLevel:(r,s)=>{this.say(r<s?"Loading detail …":""),this.touch()}})}get whole(){return this.row===null}get edited(){return this.renderer.edited}set edited(e){this.renderer.edited=e,this.touch()}get plays(){return this.playing!==null}play(e){this.playing=e&&this.header.path?performance.now():null,this.touch()}home(){this.look(this.header.start),this.playing=null}get tangent(){return Math.tan(this.fov*Math.PI/360)}look(e){this.orbit=new ye(e.c2w,this.header.up,this.header.centre),this.fov=e.fov_y_deg,this.touch()}change(e){this.playing=null,e(),this.touch()}touch(){this.moved=performance.now(),this.row=0}async draw(){for(;;){await new Promise(e=>requestAnimationFrame(e));try{await this.frame()}catch(e){this.say(e instanceof Error?e.message:String(e));return}}}async frame(){const{canvas:e,gl:t,renderer:r,pacing:s}=this,{path:n}=this.header;if(this.playing!==null&&n){const y=(performance.now()-this.playing)/1e3;this.look(wt(n,y)),!n.loop&&y>=n.seconds&&(this.playing=null)}if(this.row===null)return;const i=Math.min(devicePixelRatio,gt),[a,c]=[e.clientWidth,e.clientHeight].map(y=>Math.max(1,Math.round(y*i)));(e.width!==a||e.height!==c)&&Object.assign(e,{width:a,height:c});const l=s.scale(a,c),u=performance.now()-this.moved>vt||l===1,h=u?[a,c]:[a,c].map(y=>Math.max(8,Math.round(y*l)));this.aim(h[0],h[1]);const d=u?this.row:0,m=u?Math.min(s.rows(a,c),c-d):h[1],f=this.moved;if(!r.render({rows:{first:d,count:m}}))return;const p=d+m>=h[1];p&&r.show(a,c),s.took(h[0]*m,await pt(t)),this.moved===f&&u&&(this.row=p?null:d+m)}aim(e,t){const r=.5*Math.min(e,t)/this.tangent;this.renderer.setSize(e,t),this.renderer.setCamera({c2w:this.orbit.c2w,width:e,height:t,fx:r,fy:r,cx:e/2,cy:t/2})}}window.cagefieldViewer={FieldRenderer:re,readEdits:se,SplatRenderer:xt,readSplatEdits:Je};function L(o){const e=document.querySelector(o);if(!e)throw new Error(`the page has no ${o}`);return e}function we(o){const e=document.getElementById(o);if(!e)return null;const t=atob(e.textContent.trim());e.remove();const r=new Uint8Array(t.length);for(let s=0;s<t.length;s++)r[s]=t.charCodeAt(s);return r.buffer}async function Tt(o){const e=L(".message"),t=r=>void(e.textContent=r);try{const r=new Et(L("canvas"),o,t);window.cagefieldViewer.viewer=r;const[s,n,i]=[L(".compare"),L(".play"),L(".home")],a=we("field"),c=we("edits");if(s.hidden=c===null,n.hidden=o.path===null,s.onclick=()=>{r.edited=!r.edited,s.textContent=r.edited?"Show before":"Show after"},n.onclick=()=>r.play(!r.plays),i.onclick=()=>r.home(),setInterval(()=>void(n.textContent=r.plays?"Stop":"Play"),200),window.addEventListener("keydown",({key:l})=>{l==="b"&&s.click(),l===" "&&n.click(),l==="h"&&i.click()}),a===null)throw new Error("the file holds no field; export the scene again");await r.run(a,c)}catch(r){t(r instanceof Error?r.message:String(r))}}const ve=document.getElementById("scene");ve&&Tt(JSON.parse(ve.textContent))})();
